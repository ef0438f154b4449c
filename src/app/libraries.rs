//! Whether the window system's libraries are there. The window library loads them when it opens a window, and panics without some.

use crate::error::{Error, Result};

/// A library, and the Debian package that has it.
struct Library {
    file: &'static str,
    package: &'static str,
}

const fn library(file: &'static str, package: &'static str) -> Library {
    Library { file, package }
}

const X11: &[Library] = &[
    library("libX11.so.6", "libx11-6"),
    library("libX11-xcb.so.1", "libx11-xcb1"),
    library("libXcursor.so.1", "libxcursor1"),
    library("libXi.so.6", "libxi6"),
    library("libxkbcommon.so.0", "libxkbcommon0"),
    library("libxkbcommon-x11.so.0", "libxkbcommon-x11-0"),
];

const WAYLAND: &[Library] =
    &[library("libwayland-client.so.0", "libwayland-client0"), library("libxkbcommon.so.0", "libxkbcommon0")];

/// Checks that there is a display, by the environment's variables, and the libraries to draw to it.
///
/// # Errors
/// [`Error::NoWindow`] that says what to set or to install.
pub fn check(variable: impl Fn(&str) -> Option<String>, can_load: impl Fn(&str) -> bool) -> Result<()> {
    let is_set = |name| variable(name).is_some_and(|value| !value.is_empty());
    // The same choice as winit's.
    let needed = if is_set("WAYLAND_DISPLAY") || is_set("WAYLAND_SOCKET") {
        WAYLAND
    } else if is_set("DISPLAY") {
        X11
    } else {
        return Err(Error::NoWindow(
            "there is no display to open a window on: neither WAYLAND_DISPLAY nor DISPLAY is set; `view --script FILE --headless` \
             needs none"
                .to_owned(),
        ));
    };
    let missing: Vec<&Library> = needed.iter().filter(|library| !can_load(library.file)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list = |name: fn(&Library) -> &str| missing.iter().map(|library| name(library)).collect::<Vec<_>>();
    Err(Error::NoWindow(format!(
        "a window needs {}, which cannot be loaded; `apt install {}` on Debian or Ubuntu",
        list(|library| library.file).join(", "),
        list(|library| library.package).join(" ")
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(set: &'static [(&str, &str)], lacking: &'static [&str]) -> Result<(), String> {
        let variable = |name: &str| set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned());
        let checked = check(variable, |file| !lacking.contains(&file));
        checked.map_err(|error| {
            assert_eq!(error.exit_status(), 3);
            error.to_string()
        })
    }

    #[test]
    fn only_what_the_display_needs_must_be_there() {
        assert_eq!(with(&[("DISPLAY", ":0")], &["libwayland-client.so.0"]), Ok(()));
        assert_eq!(with(&[("WAYLAND_DISPLAY", "wayland-0")], &["libX11.so.6", "libxkbcommon-x11.so.0"]), Ok(()));
        assert!(with(&[("WAYLAND_SOCKET", "5"), ("DISPLAY", ":0")], &["libwayland-client.so.0"]).is_err());
    }

    #[test]
    fn what_is_missing_is_named_with_its_package() {
        let fault = with(&[("DISPLAY", ":0"), ("WAYLAND_DISPLAY", "")], &["libxkbcommon-x11.so.0"]).unwrap_err();
        assert!(
            fault.contains("libxkbcommon-x11.so.0") && fault.contains("apt install libxkbcommon-x11-0`"),
            "{fault}"
        );
        let fault = with(&[("DISPLAY", ":0")], &["libX11.so.6", "libXi.so.6"]).unwrap_err();
        assert!(fault.contains("apt install libx11-6 libxi6`"), "{fault}");
    }

    #[test]
    fn no_display_is_said() {
        let fault = with(&[("DISPLAY", "")], &[]).unwrap_err();
        assert!(fault.contains("WAYLAND_DISPLAY nor DISPLAY") && fault.contains("--headless"), "{fault}");
    }
}
