//! Keys and mouse turned into commands, by the triggers of the table.

use super::command::Command;
use super::table::{self, ENTRIES};
use super::trigger::Trigger;
use super::words::split;
use glam::{Vec2, Vec3};
use std::collections::BTreeMap;
use winit::keyboard::KeyCode;

/// Degrees that the view turns while the cursor crosses the image's height.
const TURN: f32 = 90.0;
/// Degrees that the scene turns likewise.
const ORBIT: f32 = 180.0;
/// The distance that a notch of the wheel leaves.
const DOLLY: f32 = 0.9;
/// What a notch of the wheel makes of the speed.
const FASTER: f32 = 1.25;
/// What Shift makes of the velocity, and Ctrl divides it by.
const SHIFT: f32 = 3.0;
/// Seconds and pixels between the clicks of a double click, at most.
const DOUBLE_CLICK: (f64, f32) = (0.4, 6.0);

/// A button of the mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The left one.
    Left,
    /// The middle one, or the wheel pressed.
    Middle,
    /// The right one.
    Right,
}

/// What happened at the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A key, by its place on the keyboard.
    Key {
        /// Its place.
        code: KeyCode,
        /// Whether it went down.
        pressed: bool,
        /// Whether it was down for long.
        repeat: bool,
        /// What is printed on it.
        printed: Option<String>,
    },
    /// Which of the keys that change others are held.
    Modifiers {
        /// Ctrl.
        control: bool,
        /// Shift.
        shift: bool,
        /// Alt.
        alt: bool,
    },
    /// The cursor is here, pixels from the top left.
    Cursor(Vec2),
    /// A button of the mouse.
    Button {
        /// Which one.
        button: Button,
        /// Whether it went down.
        pressed: bool,
    },
    /// The wheel, notches away from the user.
    Wheel(f32),
    /// Another window has the keyboard now.
    FocusLost,
}

/// What the panels keep for themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    /// The mouse is over a panel, or drags something there.
    pub mouse: bool,
    /// Text is typed into a panel.
    pub keyboard: bool,
}

/// What the mouse does while a button is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drag {
    Look,
    Orbit,
    Pan,
}

/// The state of keys and mouse.
#[derive(Debug, Default)]
pub struct Controls {
    cursor: Vec2,
    /// What goes on, with the button that began it, and whether the pivot is chosen.
    drag: Option<(Drag, Button, bool)>,
    control: bool,
    shift: bool,
    alt: bool,
    held: Vec<KeyCode>,
    /// Keys that are down and stand for something until they come up.
    standing: Vec<KeyCode>,
    /// The velocity that was last commanded.
    velocity: Vec3,
    last_click: Option<(f64, Vec2)>,
    printed: BTreeMap<KeyCode, String>,
}

impl Controls {
    /// What is printed on a key, as far as it is known: keys tell when they are pressed.
    #[must_use]
    pub fn printed(&self, code: KeyCode) -> Option<String> {
        self.printed.get(&code).cloned()
    }

    /// The commands that an event stands for, at a time in seconds, in a window of a size in pixels.
    pub fn commands(&mut self, event: Event, window: Vec2, now: f64, kept: Kept) -> Vec<Command> {
        match event {
            Event::Key { code, pressed, repeat, printed } => {
                self.printed.extend(printed.map(|printed| (code, printed)));
                self.key(code, (pressed, repeat), kept)
            }
            Event::Modifiers { control, shift, alt } => {
                (self.control, self.shift, self.alt) = (control, shift, alt);
                self.flight().into_iter().collect()
            }
            Event::Cursor(at) => {
                let moved = (at - std::mem::replace(&mut self.cursor, at)) / window.y.max(1.0);
                self.dragged(moved, self.cursor - moved * window.y, window)
            }
            Event::Button { button, pressed: true } if !kept.mouse => self.press(button, window, now),
            Event::Button { button, pressed: false } => self.release(button),
            Event::Button { .. } => Vec::new(),
            Event::Wheel(notches) => self.wheel(notches, window, kept),
            Event::FocusLost => {
                self.held.clear();
                self.drag = None;
                let ended: Vec<Command> = self.standing.drain(..).filter_map(|code| standing(code, false)).collect();
                ended.into_iter().chain(self.flight()).collect()
            }
        }
    }

    fn is_looking(&self) -> bool {
        matches!(self.drag, Some((Drag::Look, ..)))
    }

    fn key(&mut self, code: KeyCode, (pressed, repeat): (bool, bool), kept: Kept) -> Vec<Command> {
        self.held.retain(|held| *held != code);
        if pressed {
            self.held.push(code);
        }
        // While the mouse looks, keys that fly do nothing else.
        if self.is_looking() && direction(code).is_some() {
            return self.flight().into_iter().collect();
        }
        if !pressed {
            return self.come_up(code).into_iter().collect();
        }
        let acts = !repeat && !kept.keyboard;
        acts.then(|| self.go_down(code).or_else(|| self.chord(code))).flatten().into_iter().collect()
    }

    /// The command of a key that stands for something until it comes up.
    fn go_down(&mut self, code: KeyCode) -> Option<Command> {
        let command = standing(code, true)?;
        self.standing.push(code);
        Some(command)
    }

    fn come_up(&mut self, code: KeyCode) -> Option<Command> {
        let at = self.standing.iter().position(|standing| *standing == code)?;
        standing(self.standing.swap_remove(at), false)
    }

    /// The command of a key with those held beside it.
    fn chord(&self, code: KeyCode) -> Option<Command> {
        let all = ENTRIES.iter().flat_map(|entry| entry.triggers.iter().map(move |trigger| (entry.name, trigger)));
        let mut lines = all.filter_map(|(name, trigger)| match trigger {
            Trigger::Key(chord, arguments) if chord.code == code && chord.control == self.control => {
                Some(format!("{name} {arguments}"))
            }
            _ => None,
        });
        command_of(&lines.next()?)
    }

    /// The velocity that keys ask for, if it is another than before.
    fn flight(&mut self) -> Option<Command> {
        let factor = if self.shift { SHIFT } else { 1.0 } / if self.control { SHIFT } else { 1.0 };
        let held: Vec3 = self.held.iter().filter_map(|code| direction(*code)).sum();
        let velocity = if self.is_looking() { held * factor } else { Vec3::ZERO };
        let changed = velocity != std::mem::replace(&mut self.velocity, velocity);
        changed.then_some(Command::Fly(velocity))
    }

    fn press(&mut self, button: Button, window: Vec2, now: f64) -> Vec<Command> {
        if self.drag.is_some() {
            return Vec::new();
        }
        if button == Button::Left && self.alt {
            return vec![Command::Explain(share(self.cursor, window))];
        }
        let drag = match button {
            Button::Left if self.shift => Drag::Pan,
            Button::Left => Drag::Orbit,
            Button::Middle => Drag::Pan,
            Button::Right => Drag::Look,
        };
        self.drag = Some((drag, button, false));
        if button == Button::Left && !self.shift {
            let before = self.last_click.replace((now, self.cursor));
            let (seconds, pixels) = DOUBLE_CLICK;
            let near = |(then, at): (f64, Vec2)| now - then < seconds && at.distance(self.cursor) < pixels;
            if before.is_some_and(near) {
                self.last_click = None;
                return vec![Command::Centre(share(self.cursor, window))];
            }
        }
        self.flight().into_iter().collect()
    }

    fn release(&mut self, button: Button) -> Vec<Command> {
        if self.drag.is_some_and(|(_, began, _)| began == button) {
            self.drag = None;
        }
        self.flight().into_iter().collect()
    }

    /// The cursor moved by these shares of the window's height, from a place.
    fn dragged(&mut self, moved: Vec2, from: Vec2, window: Vec2) -> Vec<Command> {
        let Some((drag, _, pivot_is_chosen)) = &mut self.drag else { return Vec::new() };
        if moved == Vec2::ZERO {
            return Vec::new();
        }
        if *drag == Drag::Look {
            return vec![Command::Look((moved * TURN).to_array())];
        }
        let chosen = std::mem::replace(pivot_is_chosen, true);
        let pivot = (!chosen).then(|| Command::Pivot(share(from, window)));
        let turned = match drag {
            Drag::Pan => Command::Pan(moved.to_array()),
            Drag::Orbit | Drag::Look => Command::Orbit((moved * ORBIT).to_array()),
        };
        pivot.into_iter().chain([turned]).collect()
    }

    fn wheel(&mut self, notches: f32, window: Vec2, kept: Kept) -> Vec<Command> {
        match () {
            () if notches == 0.0 => Vec::new(),
            () if self.is_looking() => vec![Command::Speed(FASTER.powf(notches))],
            () if kept.mouse => Vec::new(),
            () => vec![Command::Pivot(share(self.cursor, window)), Command::Dolly(DOLLY.powf(notches))],
        }
    }
}

/// The command that a line says.
fn command_of(line: &str) -> Option<Command> {
    table::parse(&split(line).ok()?).ok()
}

/// The command of a key that stands for something while it is down, when it goes down or comes up.
fn standing(code: KeyCode, down: bool) -> Option<Command> {
    let all = ENTRIES.iter().flat_map(|entry| entry.triggers.iter().map(move |trigger| (entry.name, trigger)));
    let mut lines = all.filter_map(|(name, trigger)| match trigger {
        Trigger::While(held, [on, off]) if *held == code => Some(format!("{name} {}", if down { on } else { off })),
        _ => None,
    });
    command_of(&lines.next()?)
}

/// Where a key flies.
fn direction(code: KeyCode) -> Option<Vec3> {
    ENTRIES.iter().flat_map(|entry| entry.triggers).find_map(|trigger| match trigger {
        Trigger::Held(held, direction) if *held == code => Some(Vec3::from_array(*direction)),
        _ => None,
    })
}

/// A place of a window in shares of its width and height.
fn share(at: Vec2, window: Vec2) -> Vec2 {
    (at / window.max(Vec2::ONE)).clamp(Vec2::ZERO, Vec2::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Vec2 = Vec2::new(800.0, 400.0);

    fn send(controls: &mut Controls, events: &[Event]) -> Vec<String> {
        let kept = Kept::default();
        events
            .iter()
            .flat_map(|event| controls.commands(event.clone(), WINDOW, 1.0, kept))
            .map(|command| command.to_string())
            .collect()
    }

    fn key(code: KeyCode, pressed: bool) -> Event {
        Event::Key { code, pressed, repeat: false, printed: None }
    }

    fn button(button: Button, pressed: bool) -> Event {
        Event::Button { button, pressed }
    }

    fn at(x: f32, y: f32) -> Event {
        Event::Cursor(Vec2::new(x, y))
    }

    #[test]
    fn the_reference_is_shown_while_its_key_is_down() {
        let mut controls = Controls::default();
        assert_eq!(send(&mut controls, &[key(KeyCode::Space, true)]), ["reference.show on"]);
        let again = Event::Key { code: KeyCode::Space, pressed: true, repeat: true, printed: None };
        assert_eq!(send(&mut controls, &[again, key(KeyCode::Space, false)]), ["reference.show off"]);
        assert_eq!(send(&mut controls, &[key(KeyCode::Space, false)]), [""; 0]);
        let left = [key(KeyCode::Space, true), Event::FocusLost, key(KeyCode::Space, false)];
        assert_eq!(send(&mut controls, &left), ["reference.show on", "reference.show off"]);
    }

    #[test]
    fn keys_fly_only_while_the_right_button_is_held() {
        let mut controls = Controls::default();
        let forward = [key(KeyCode::KeyW, true), key(KeyCode::KeyW, false)];
        assert_eq!(send(&mut controls, &forward), [""; 0]);
        let flight = [
            key(KeyCode::KeyW, true),
            button(Button::Right, true),
            key(KeyCode::KeyD, true),
            Event::Modifiers { control: false, shift: true, alt: false },
            key(KeyCode::KeyW, false),
            button(Button::Right, false),
        ];
        let expected =
            ["camera.fly 0 0 1", "camera.fly 1 0 1", "camera.fly 3 0 3", "camera.fly 3 0 0", "camera.fly 0 0 0"];
        assert_eq!(send(&mut controls, &flight), expected);
    }

    #[test]
    fn flying_slowly_down_does_not_quit() {
        let mut controls = Controls::default();
        let control = Event::Modifiers { control: true, shift: false, alt: false };
        let events = [button(Button::Right, true), control.clone(), key(KeyCode::KeyQ, true)];
        let sent = send(&mut controls, &events);
        assert!(sent.len() == 1 && sent[0].starts_with("camera.fly 0 -0.333"), "{sent:?}");
        assert_eq!(send(&mut Controls::default(), &[control, key(KeyCode::KeyQ, true)]), ["app.quit"]);
    }

    #[test]
    fn losing_the_keyboard_stops_the_flight() {
        let mut controls = Controls::default();
        let events = [button(Button::Right, true), key(KeyCode::KeyE, true), Event::FocusLost, at(9.0, 9.0)];
        assert_eq!(send(&mut controls, &events), ["camera.fly 0 1 0", "camera.fly 0 0 0"]);
    }

    #[test]
    fn drags_choose_the_point_under_the_cursor_first() {
        let mut controls = Controls::default();
        let drag = [at(400.0, 100.0), button(Button::Left, true), at(440.0, 100.0), at(440.0, 80.0)];
        let expected = ["camera.pivot 0.5 0.25", "camera.orbit 18 0", "camera.orbit 0 -9"];
        assert_eq!(send(&mut controls, &drag), expected);
        assert_eq!(send(&mut controls, &[button(Button::Left, false), at(0.0, 0.0)]), [""; 0]);
        let pan = [button(Button::Middle, true), at(40.0, 0.0), button(Button::Middle, false)];
        assert_eq!(send(&mut controls, &pan), ["camera.pivot 0 0", "camera.pan 0.1 0"]);
        let look = [button(Button::Right, true), at(40.0, 40.0), Event::Wheel(1.0)];
        assert_eq!(send(&mut controls, &look), ["camera.look 0 9", "camera.speed 1.25"]);
    }

    #[test]
    fn wheel_and_double_click_go_by_the_cursor() {
        let mut controls = Controls::default();
        let click = [button(Button::Left, true), button(Button::Left, false)];
        let events = [at(200.0, 300.0), Event::Wheel(1.0)];
        assert_eq!(send(&mut controls, &events), ["camera.pivot 0.25 0.75", "camera.dolly 0.9"]);
        let clicks: Vec<Event> = click.iter().chain(&click).chain(&click).cloned().collect();
        assert_eq!(send(&mut controls, &clicks), ["camera.centre 0.25 0.75"], "a third click is a first one");
    }

    #[test]
    fn alt_and_a_click_ask_about_a_pixel_and_turn_nothing() {
        let mut controls = Controls::default();
        let alt = |alt| Event::Modifiers { control: false, shift: false, alt };
        let click = [at(200.0, 300.0), alt(true), button(Button::Left, true), at(240.0, 300.0)];
        assert_eq!(send(&mut controls, &click), ["pixel.explain 0.25 0.75"]);
        let drag = [button(Button::Left, false), alt(false), button(Button::Left, true), at(280.0, 300.0)];
        assert_eq!(send(&mut controls, &drag), ["camera.pivot 0.3 0.75", "camera.orbit 18 0"]);
    }

    #[test]
    fn panels_keep_what_is_theirs() {
        let mut controls = Controls::default();
        let kept = Kept { mouse: true, keyboard: true };
        for event in [key(KeyCode::KeyH, true), button(Button::Left, true), Event::Wheel(1.0), at(5.0, 5.0)] {
            assert_eq!(controls.commands(event, WINDOW, 0.0, kept), []);
        }
        assert_eq!(
            send(&mut controls, &[key(KeyCode::KeyH, true), key(KeyCode::Digit3, true)]),
            ["help.toggle", "camera.go 3"]
        );
    }

    #[test]
    fn keys_tell_what_is_printed_on_them() {
        let mut controls = Controls::default();
        let printed = Some("Z".to_owned());
        send(&mut controls, &[Event::Key { code: KeyCode::KeyW, pressed: true, repeat: false, printed }]);
        assert_eq!(controls.printed(KeyCode::KeyW).as_deref(), Some("Z"));
        assert_eq!(controls.printed(KeyCode::KeyS), None);
    }
}
