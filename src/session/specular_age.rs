//! How old the specular luminance is that pictures show: S is for the eye of one view, and comes from the engine after the camera has moved.

/// Pictures of later views that S may be shown in. A highlight that lags behind by two is hardly seen to; one that stays while the camera
/// walks on is painted on.
const MOST: usize = 2;

/// The views that the last pictures showed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpecularAge {
    /// By generation, the last one first; 0 for none.
    pictures: [u32; MOST],
}

impl SpecularAge {
    /// Notes a picture of a view.
    pub(super) fn picture(&mut self, of: u32) {
        self.pictures.rotate_right(1);
        self.pictures[0] = of;
    }

    /// Whether S of the view `answered` would be too old in one more picture of a later view. The picture then waits for the engine. S
    /// could be left out instead, but what has no other light would be black until it is back: a flash, where a walk that now and then
    /// waits some milliseconds goes on evenly.
    pub(super) fn is_over(&self, answered: u32) -> bool {
        self.pictures.iter().all(|&picture| picture > answered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures with S of an earlier view one after the other, where the engine answers only when it has to.
    fn stale_in_a_row(views: impl Iterator<Item = u32>) -> Vec<bool> {
        let (mut age, mut answered) = (SpecularAge::default(), 1);
        let stale = views.map(|view| {
            if answered != view && age.is_over(answered) {
                answered = view;
            }
            age.picture(view);
            answered != view
        });
        stale.collect()
    }

    #[test]
    fn two_pictures_may_be_stale() {
        let stands = stale_in_a_row([1, 1, 2, 2, 2, 2].into_iter());
        assert_eq!(stands, [false, false, true, true, false, false]);
        let walks = stale_in_a_row(1..=8);
        assert_eq!(walks, [false, true, true, false, true, true, false, true]);
        assert!(!SpecularAge::default().is_over(1), "nothing was shown yet");
    }
}
