//! What stands for a command: keys by their place on the keyboard, and movements of the mouse.

use winit::keyboard::KeyCode;

/// A key with those held beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chord {
    /// The key, by its place: the name is that of a US keyboard.
    pub code: KeyCode,
    /// Whether Ctrl is held.
    pub control: bool,
}

impl Chord {
    /// A key by itself.
    #[must_use]
    pub const fn of(code: KeyCode) -> Self {
        Self { code, control: false }
    }
}

/// A movement of the mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gesture {
    /// Moved with the left button held.
    DragLeft,
    /// Moved with the left button and Shift held.
    ShiftDragLeft,
    /// Moved with the middle button held.
    DragMiddle,
    /// Moved with the right button held.
    DragRight,
    /// The wheel.
    Wheel,
    /// The wheel with the right button held.
    WheelWhileLooking,
    /// Twice the left button.
    DoubleClick,
    /// The left button with Alt held.
    AltClick,
    /// The mark of a light moved with the left button held.
    DragMark,
}

impl Gesture {
    const fn label(self) -> &'static str {
        match self {
            Self::DragLeft => "drag left",
            Self::ShiftDragLeft => "Shift + drag left",
            Self::DragMiddle => "drag middle",
            Self::DragRight => "drag right",
            Self::Wheel => "wheel",
            Self::WheelWhileLooking => "hold right + wheel",
            Self::DoubleClick => "double click",
            Self::AltClick => "Alt + click",
            Self::DragMark => "drag mark",
        }
    }
}

/// Stands for a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// A key pressed, with the arguments that the command then has.
    Key(Chord, &'static str),
    /// A key held while the right button is: flies right, up, forward. Shift makes it three times as fast, Ctrl a third.
    Held(KeyCode, [f32; 3]),
    /// A key, with the arguments that the command has when it goes down, and those when it comes up.
    While(KeyCode, [&'static str; 2]),
    /// A movement of the mouse, whose extent makes the arguments.
    Gesture(Gesture),
}

impl Trigger {
    /// What is printed on the keys; `printed` tells that of a key by its place, where it is known.
    #[must_use]
    pub fn label(&self, printed: &dyn Fn(KeyCode) -> Option<String>) -> String {
        let key = |code: KeyCode| printed(code).unwrap_or_else(|| on_us_keyboard(code));
        match self {
            Self::Key(Chord { code, control: true }, _) => format!("Ctrl + {}", key(*code)),
            Self::Key(Chord { code, control: false }, _) => key(*code),
            Self::Held(code, _) => format!("hold right + {}", key(*code)),
            Self::While(code, _) => format!("hold {}", key(*code)),
            Self::Gesture(gesture) => gesture.label().to_owned(),
        }
    }
}

/// What a US keyboard has at a place.
fn on_us_keyboard(code: KeyCode) -> String {
    let name = format!("{code:?}");
    match code {
        KeyCode::Escape => "Esc".to_owned(),
        KeyCode::Minus => "-".to_owned(),
        KeyCode::Equal => "=".to_owned(),
        _ => name.strip_prefix("Key").or_else(|| name.strip_prefix("Digit")).unwrap_or(&name).to_owned(),
    }
}

/// Labels that are listed, at most; of more, the ends are named.
const MANY: usize = 4;

/// Labels of all triggers of a command, those that differ in the key alone in one.
#[must_use]
pub fn labels(triggers: &[Trigger], printed: &dyn Fn(KeyCode) -> Option<String>) -> String {
    let mut labels: Vec<String> = triggers.iter().map(|trigger| trigger.label(printed)).collect();
    let prefix = "hold right + ";
    if triggers.len() > 1 && triggers.iter().all(|trigger| matches!(trigger, Trigger::Held(..))) {
        let keys: Vec<&str> = labels.iter().map(|label| label.trim_start_matches(prefix)).collect();
        return format!("{prefix}{}", keys.join(" "));
    }
    labels.dedup();
    if let [first, .., last_but_one, last] = &labels[..]
        && labels.len() > MANY
    {
        return format!("{first} to {last_but_one}, {last}");
    }
    labels.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_say_what_is_printed_on_the_keys() {
        let us = |_| None;
        let french = |code| (code == KeyCode::KeyW).then(|| "Z".to_owned());
        let held = [Trigger::Held(KeyCode::KeyW, [0.0; 3]), Trigger::Held(KeyCode::KeyE, [0.0; 3])];
        assert_eq!(labels(&held, &us), "hold right + W E");
        assert_eq!(labels(&held, &french), "hold right + Z E");
        let quit = Trigger::Key(Chord { code: KeyCode::KeyQ, control: true }, "");
        assert_eq!(quit.label(&us), "Ctrl + Q");
        assert_eq!(Trigger::Key(Chord::of(KeyCode::Digit0), "").label(&us), "0");
        assert_eq!(Trigger::While(KeyCode::Space, [""; 2]).label(&us), "hold Space");
        assert_eq!(labels(&[Trigger::Gesture(Gesture::Wheel)], &us), "wheel");
    }
}
