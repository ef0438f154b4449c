//! The table of commands: names, arguments, what each does, and what triggers it. Keys, mouse, panels, scripts and all help go by it.

use super::arguments::Arguments;
use super::command::{Command, nearest};
use super::trigger::{Chord, Gesture, Trigger};
use super::views::View;
use Trigger::{Gesture as Mouse, Held, Key, While};
use glam::Vec3;
use winit::keyboard::KeyCode;

/// A command of the table.
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// Names of its arguments, separated by blanks; one that may be left out is in brackets.
    pub arguments: &'static str,
    /// What it does, in a line.
    pub help: &'static str,
    /// Arguments as somebody would type them.
    pub example: &'static str,
    /// Keys and movements of the mouse that stand for it.
    pub triggers: &'static [Trigger],
    /// Makes it of its arguments, as many as there are names.
    pub(super) parse: fn(&Arguments<'_>) -> Result<Command, String>,
}

impl Entry {
    /// The entry of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ENTRIES.iter().find(|entry| entry.name == name)
    }

    /// Name and arguments.
    #[must_use]
    pub fn usage(&self) -> String {
        format!("{} {}", self.name, self.arguments).trim_end().to_owned()
    }

    /// A line that somebody would type.
    #[must_use]
    pub fn example_line(&self) -> String {
        format!("{} {}", self.name, self.example).trim_end().to_owned()
    }

    /// How many arguments it takes, at least and at most.
    pub(super) fn argument_counts(&self) -> (usize, usize) {
        let names = || self.arguments.split(' ').filter(|name| !name.is_empty());
        (names().filter(|name| !name.starts_with('[')).count(), names().count())
    }
}

/// The command that words say: its name and arguments.
///
/// # Errors
/// What is wrong with them, and what would be right.
pub fn parse(words: &[String]) -> Result<Command, String> {
    let (name, arguments) = words.split_first().ok_or("a command is missing")?;
    let entry = Entry::named(name).ok_or_else(|| unknown(name))?;
    let (least, most) = entry.argument_counts();
    if arguments.len() < least || arguments.len() > most {
        return Err(format!("expected `{}`, as in `{}`", entry.usage(), entry.example_line()));
    }
    (entry.parse)(&Arguments { names: entry.arguments, example: entry.example_line(), words: arguments })
}

fn unknown(name: &str) -> String {
    match nearest(name, ENTRIES.iter().map(|entry| entry.name)) {
        Some(near) => format!("there is no command `{name}`: did you mean `{near}`?"),
        None => format!("there is no command `{name}`; `penombre help view` lists them"),
    }
}

/// Half a stop, which is just seen.
const STOP: &str = "0.5";

/// All commands.
pub const ENTRIES: &[Entry] = &[
    Entry {
        name: "camera.fly",
        arguments: "RIGHT UP FORWARD",
        help: "Fly on at this velocity, in multiples of the speed",
        example: "0 0 1",
        triggers: &[
            Held(KeyCode::KeyW, [0.0, 0.0, 1.0]),
            Held(KeyCode::KeyA, [-1.0, 0.0, 0.0]),
            Held(KeyCode::KeyS, [0.0, 0.0, -1.0]),
            Held(KeyCode::KeyD, [1.0, 0.0, 0.0]),
            Held(KeyCode::KeyE, [0.0, 1.0, 0.0]),
            Held(KeyCode::KeyQ, [0.0, -1.0, 0.0]),
        ],
        parse: |a| Ok(Command::Fly(Vec3::from_array(a.numbers(0)?))),
    },
    Entry {
        name: "camera.speed",
        arguments: "FACTOR",
        help: "Multiply the speed of flying",
        example: "1.25",
        triggers: &[Mouse(Gesture::WheelWhileLooking)],
        parse: |a| Ok(Command::Speed(a.factor(0)?)),
    },
    Entry {
        name: "camera.look",
        arguments: "RIGHT DOWN",
        help: "Turn the view, degrees",
        example: "15 -5",
        triggers: &[Mouse(Gesture::DragRight)],
        parse: |a| Ok(Command::Look(a.numbers(0)?)),
    },
    Entry {
        name: "camera.pivot",
        arguments: "X Y",
        help: "Choose the point seen at a place of the image, in shares of its width and height, to orbit, pan and dolly about",
        example: "0.5 0.5",
        triggers: &[],
        parse: |a| Ok(Command::Pivot(a.place()?)),
    },
    Entry {
        name: "camera.orbit",
        arguments: "RIGHT DOWN",
        help: "Turn the scene about the pivot, degrees",
        example: "30 0",
        triggers: &[Mouse(Gesture::DragLeft)],
        parse: |a| Ok(Command::Orbit(a.numbers(0)?)),
    },
    Entry {
        name: "camera.pan",
        arguments: "RIGHT DOWN",
        help: "Shift the scene so that the pivot moves by these shares of the image's height",
        example: "0.1 0",
        triggers: &[Mouse(Gesture::DragMiddle), Mouse(Gesture::ShiftDragLeft)],
        parse: |a| Ok(Command::Pan(a.numbers(0)?)),
    },
    Entry {
        name: "camera.dolly",
        arguments: "FACTOR",
        help: "Multiply the distance from the pivot",
        example: "0.9",
        triggers: &[Mouse(Gesture::Wheel)],
        parse: |a| Ok(Command::Dolly(a.factor(0)?)),
    },
    Entry {
        name: "camera.centre",
        arguments: "X Y",
        help: "Look at the point seen at a place of the image",
        example: "0.25 0.5",
        triggers: &[Mouse(Gesture::DoubleClick)],
        parse: |a| Ok(Command::Centre(a.place()?)),
    },
    Entry {
        name: "camera.frame-all",
        arguments: "",
        help: "Step back until all of the scene is in view",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::KeyF), "")],
        parse: |_| Ok(Command::FrameAll),
    },
    Entry {
        name: "camera.go",
        arguments: "NAME",
        help: "Take a camera of the scene, by name or number; 0 is the last one that was flown",
        example: "1",
        triggers: &[
            Key(Chord::of(KeyCode::Digit1), "1"),
            Key(Chord::of(KeyCode::Digit2), "2"),
            Key(Chord::of(KeyCode::Digit3), "3"),
            Key(Chord::of(KeyCode::Digit4), "4"),
            Key(Chord::of(KeyCode::Digit5), "5"),
            Key(Chord::of(KeyCode::Digit6), "6"),
            Key(Chord::of(KeyCode::Digit7), "7"),
            Key(Chord::of(KeyCode::Digit8), "8"),
            Key(Chord::of(KeyCode::Digit9), "9"),
            Key(Chord::of(KeyCode::Digit0), "0"),
        ],
        parse: |a| Ok(Command::Go(a.text(0).to_owned())),
    },
    Entry {
        name: "camera.place",
        arguments: "X Y Z AT-X AT-Y AT-Z",
        help: "Place the camera, and what it looks at, in coordinates of the scene's files",
        example: "0 1 3 0 1 0",
        triggers: &[],
        parse: |a| Ok(Command::Place { position: a.point(0)?, look_at: a.point(3)? }),
    },
    Entry {
        name: "camera.record",
        arguments: "PATH.toml",
        help: "Record the camera and the lights from now on, for `render --camera-path`",
        example: "walk.toml",
        triggers: &[],
        parse: |a| Ok(Command::RecordCamera(a.text(0).into())),
    },
    Entry {
        name: "session.record",
        arguments: "SCRIPT",
        help: "Record what is done from now on, for `view --script`",
        example: "walk.script",
        triggers: &[],
        parse: |a| Ok(Command::RecordSession(a.text(0).into())),
    },
    Entry {
        name: "record.stop",
        arguments: "",
        help: "Write what was recorded; the end does so, too",
        example: "",
        triggers: &[],
        parse: |_| Ok(Command::RecordStop),
    },
    Entry {
        name: "light.toggle",
        arguments: "NAME",
        help: "Switch a light off or on",
        example: "lamp",
        triggers: &[],
        parse: |a| Ok(Command::ToggleLight(a.text(0).to_owned())),
    },
    Entry {
        name: "light.dim",
        arguments: "NAME FACTOR",
        help: "Set a light's power, as a factor on that of the scene",
        example: "lamp 0.5",
        triggers: &[],
        parse: |a| Ok(Command::DimLight(a.text(0).to_owned(), a.number_in(1, [0.0, 1e6])?)),
    },
    Entry {
        name: "light.colour",
        arguments: "NAME R G B",
        help: "Set a light's colour, as factors on that of the scene",
        example: "lamp 1 0.6 0.3",
        triggers: &[],
        parse: |a| Ok(Command::ColourLight(a.text(0).to_owned(), a.numbers_in(1, [0.0, 1e6])?)),
    },
    Entry {
        name: "light.move",
        arguments: "NAME X Y Z",
        help: "Put a point or spot light somewhere, in coordinates of the scene's files",
        example: "lamp 0 2.5 0",
        triggers: &[Mouse(Gesture::DragMark)],
        parse: |a| Ok(Command::MoveLight(a.text(0).to_owned(), a.point(1)?)),
    },
    Entry {
        name: "view.next",
        arguments: "",
        help: "Show the next debug view",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::KeyV), "")],
        parse: |_| Ok(Command::NextView),
    },
    Entry {
        name: "view.set",
        arguments: "VIEW [LIGHT]",
        help: "Show a debug view, of a light if there is one for each: final, kd, ks, Le, D, S, direct, indirect, face.id, level, \
               error, stale, mesh, light-mesh, beside",
        example: "direct lamp",
        triggers: &[],
        parse: |a| Ok(Command::View(View::named(a.text(0))?, a.rest(1))),
    },
    Entry {
        name: "reference.show",
        arguments: "on|off",
        help: "Show the path-traced reference in place of the picture; of the same view and lights it goes on where it stopped",
        example: "on",
        triggers: &[While(KeyCode::Space, ["on", "off"])],
        parse: |a| Ok(Command::Reference(a.switch(0)?)),
    },
    Entry {
        name: "update.set",
        arguments: "MODE",
        help: "Set how changed lighting is redrawn",
        example: "stencil",
        triggers: &[],
        parse: |a| Ok(Command::Update(a.update_mode()?)),
    },
    Entry {
        name: "exposure.set",
        arguments: "STOPS",
        help: "Set the exposure",
        example: "1.5",
        triggers: &[],
        parse: |a| Ok(Command::Exposure(a.number_in(0, [-64.0, 64.0])?)),
    },
    Entry {
        name: "exposure.add",
        arguments: "STOPS",
        help: "Change the exposure",
        example: STOP,
        triggers: &[Key(Chord::of(KeyCode::Minus), "-0.5"), Key(Chord::of(KeyCode::Equal), STOP)],
        parse: |a| Ok(Command::Expose(a.number_in(0, [-64.0, 64.0])?)),
    },
    Entry {
        name: "tone-mapping.set",
        arguments: "OPERATOR",
        help: "Set the tone-mapping operator",
        example: "agx",
        triggers: &[],
        parse: |a| Ok(Command::ToneMapping(a.operator()?)),
    },
    Entry {
        name: "tone-mapping.next",
        arguments: "",
        help: "Take the next tone-mapping operator",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::KeyT), "")],
        parse: |_| Ok(Command::NextToneMapping),
    },
    Entry {
        name: "scene.reload",
        arguments: "",
        help: "Load the scene again, which a window does by itself when a file of it changes; camera and switches stay",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::F5), "")],
        parse: |_| Ok(Command::Reload),
    },
    Entry {
        name: "window.screenshot",
        arguments: "[PATH]",
        help: "Write what the window shows (.png), or the picture with its layers (.exr); without a path both, with a number",
        example: "shot.png",
        triggers: &[Key(Chord::of(KeyCode::F12), "")],
        parse: |a| Ok(Command::Screenshot(a.picture()?)),
    },
    Entry {
        name: "window.picture",
        arguments: "[PATH]",
        help: "The same without what lies over the picture",
        example: "picture.png",
        triggers: &[Key(Chord { code: KeyCode::F12, control: true }, "")],
        parse: |a| Ok(Command::Picture(a.picture()?)),
    },
    Entry {
        name: "pixel.explain",
        arguments: "X Y",
        help: "Explain the pixel at a place of the image: its triangle, vertices and lights; the same again closes it",
        example: "0.5 0.5",
        triggers: &[Mouse(Gesture::AltClick)],
        parse: |a| Ok(Command::Explain(a.place()?)),
    },
    Entry {
        name: "pixel.save",
        arguments: "PATH.json",
        help: "Write what is said of the pixel that is explained, as `penombre probe` does",
        example: "pixel.json",
        triggers: &[],
        parse: |a| Ok(Command::SaveExplanation(a.text(0).into())),
    },
    Entry {
        name: "hud.toggle",
        arguments: "",
        help: "Show or hide the panel",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::Tab), "")],
        parse: |_| Ok(Command::ToggleHud),
    },
    Entry {
        name: "hud.lights",
        arguments: "",
        help: "Open or close the list of lights in the panel",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::KeyL), "")],
        parse: |_| Ok(Command::ToggleLights),
    },
    Entry {
        name: "help.toggle",
        arguments: "",
        help: "Show or hide this help",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::KeyH), "")],
        parse: |_| Ok(Command::ToggleHelp),
    },
    Entry {
        name: "app.back",
        arguments: "",
        help: "Close what is open",
        example: "",
        triggers: &[Key(Chord::of(KeyCode::Escape), "")],
        parse: |_| Ok(Command::Back),
    },
    Entry {
        name: "app.quit",
        arguments: "",
        help: "End",
        example: "",
        triggers: &[Key(Chord { code: KeyCode::KeyQ, control: true }, "")],
        parse: |_| Ok(Command::Quit),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::words::split;
    use std::collections::HashSet;

    #[test]
    fn commands_parse_from_what_their_help_says_and_print_it_again() {
        for entry in ENTRIES {
            let line = entry.example_line();
            let command = parse(&split(&line).unwrap()).unwrap_or_else(|e| panic!("{line}: {e}"));
            assert_eq!(command.to_string(), line);
            assert_eq!(command.words().0, entry.name);
            let (least, most) = entry.argument_counts();
            let examples = entry.example.split_whitespace().count();
            assert!((least..=most).contains(&examples), "{line}");
            let too_many = vec!["1".to_owned(); most + 1];
            let words: Vec<String> = std::iter::once(entry.name.to_owned()).chain(too_many).collect();
            assert!(parse(&words).unwrap_err().contains(&entry.usage()), "{line}");
        }
    }

    #[test]
    fn names_and_triggers_are_unique() {
        let mut names = HashSet::new();
        let mut triggers = HashSet::new();
        for entry in ENTRIES {
            assert!(names.insert(entry.name), "{}", entry.name);
            for trigger in entry.triggers {
                assert!(triggers.insert(trigger.label(&|_| None)), "{}", trigger.label(&|_| None));
            }
        }
    }

    #[test]
    fn keys_stand_for_commands_that_parse() {
        for entry in ENTRIES {
            for trigger in entry.triggers {
                let arguments = match trigger {
                    Key(_, arguments) => vec![*arguments],
                    While(_, both) => both.to_vec(),
                    Held(..) | Mouse(_) => vec![],
                };
                for arguments in arguments {
                    let words = split(&format!("{} {arguments}", entry.name)).unwrap();
                    parse(&words).unwrap_or_else(|e| panic!("{words:?}: {e}"));
                }
            }
        }
    }

    #[test]
    fn faults_say_what_would_be_right() {
        let fault = |line: &str| parse(&split(line).unwrap()).unwrap_err();
        assert_eq!(fault("camera.flie 1 2 3"), "there is no command `camera.flie`: did you mean `camera.fly`?");
        assert_eq!(fault("camera.fly 1 2"), "expected `camera.fly RIGHT UP FORWARD`, as in `camera.fly 0 0 1`");
        assert_eq!(
            fault("light.dim lamp -1"),
            "-1: expected a number from 0 to 1000000 for FACTOR, as in `light.dim lamp 0.5`"
        );
        assert!(fault("camera.look nan 0").contains("expected a number for RIGHT"));
        assert!(fault("camera.fly 0 inf 0").contains("expected a number for UP"));
        assert!(fault("camera.pivot 0.5 1.5").contains("from 0 to 1 for Y"));
        assert!(fault("reference.show yes").contains("expected on or off, as in `reference.show on`"));
        assert!(fault("window.screenshot a.jpg").contains(".png or .exr"));
        assert!(fault("tone-mapping.set filmic").contains("clamp, reinhard"));
        assert!(fault("quux").contains("penombre help view"));
        assert_eq!(fault(""), "a command is missing");
    }
}
