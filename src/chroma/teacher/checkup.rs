//! Checkup of a network: its contract and its answers to test images.

use super::network::{Loaded, NetworkTeacher, ProfileSource};
use super::{
    Catalog, GrayImage, TeacherError, TeacherInfo, TeacherSettings, Upsample, plausible, trial,
};
use crate::color::{gray_to_lightness, lab_to_srgb};
use crate::measure::colorfulness;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

pub use trial::Trial;

/// Result of checking a network.
#[derive(Clone, Debug, Serialize)]
pub struct Checkup {
    /// Name, kind and identity.
    #[serde(flatten)]
    pub info: TeacherInfo,
    /// Its name in the table of networks, if it is one of those.
    pub known_as: Option<String>,
    /// Inputs and outputs in words.
    pub ports: String,
    /// Source of their meaning.
    pub told_by: ProfileSource,
    /// Candidates that were tried, if there is no other source.
    pub trials: Vec<Trial>,
    /// Manifest of its profile.
    pub manifest: String,
    /// Answers to a ramp from black to white and to a photo.
    pub answers: Vec<NetworkCheck>,
}

/// Summary of a network's answer to one image.
#[derive(Clone, Debug, Serialize)]
pub struct NetworkCheck {
    /// The picture's name.
    pub picture: String,
    /// Least and largest of the answer's numbers, as they come.
    pub range: [f32; 2],
    /// Colorfulness (Hasler and Süsstrunk) of the picture in these colors.
    pub colorfulness: f64,
    /// Seconds that it takes, once the network has answered before.
    pub seconds: f64,
}

/// Looks at a network: what is understood of it, who says so, and how it answers for a ramp
/// and for a photo. One that nobody describes is asked in the ways that are usual, and taken for
/// the one whose answers make most sense.
///
/// # Errors
/// As for [`Teacher::open`](super::Teacher::open), [`TeacherError::Network`].
pub fn check(
    path: &Path,
    settings: &TeacherSettings,
    (name, photo): (&str, GrayImage<'_>),
) -> Result<Checkup, TeacherError> {
    photo.check(name)?;
    let catalog = Catalog::open()?;
    let path = catalog.locate(path)?;
    let loaded = Loaded::open(&path, settings, &catalog)?;
    let known_as = loaded.known.as_ref().map(|(name, _)| name.clone());
    let ports = loaded.ports.describe();
    let tried = |loaded| {
        let (teacher, trials) = trial::guess(loaded, settings, &[(name, photo)])?;
        Ok::<_, TeacherError>((teacher, ProfileSource::Trial, trials))
    };
    let (mut teacher, told_by, trials) = match loaded.contract(settings) {
        Ok((profile, fit, by)) => {
            let mut teacher = NetworkTeacher::following(loaded, profile, fit, settings)?;
            teacher.supposed = by == ProfileSource::Shapes;
            let asked = teacher
                .supposed
                .then(|| teacher.colorize(name, photo, None));
            match asked.transpose() {
                Ok(_) => (teacher, by, Vec::new()),
                Err(TeacherError::Senseless { .. }) => tried(teacher.loaded)?,
                Err(error) => return Err(error),
            }
        }
        Err(TeacherError::SeveralProfiles { .. } | TeacherError::NoProfile { .. })
            if settings.profile.is_none() =>
        {
            tried(loaded)?
        }
        Err(error) => return Err(error),
    };
    let ramp = plausible::ramp();
    let answers: Result<_, _> = [("ramp", plausible::as_image(&ramp)), (name, photo)]
        .into_iter()
        .map(|(name, picture)| answered(&mut teacher, name, picture))
        .collect();
    Ok(Checkup {
        info: teacher.describe(),
        known_as,
        ports,
        told_by,
        trials,
        manifest: teacher.profile.to_toml(),
        answers: answers?,
    })
}

fn answered(
    teacher: &mut NetworkTeacher,
    name: &str,
    picture: GrayImage<'_>,
) -> Result<NetworkCheck, TeacherError> {
    let numbers = teacher.look(name, &picture)?.values;
    let range = |f: fn(f32, f32) -> f32| numbers.iter().copied().reduce(f).unwrap_or(0.0);
    // The first time a network prepares itself.
    let begun = Instant::now();
    let answer = teacher.colorize(name, picture, None)?;
    let seconds = begun.elapsed().as_secs_f64();
    let ab = answer.upsampled(picture, Upsample::Guided).ab;
    let rgb = ab.iter().zip(picture.pixels).map(|(ab, &gray)| {
        let lightness = gray_to_lightness(f64::from(gray) / 255.0);
        let rgb = lab_to_srgb([lightness, ab[0].into(), ab[1].into()]);
        rgb.map(|value| value.clamp(0.0, 1.0) as f32)
    });
    Ok(NetworkCheck {
        picture: name.to_owned(),
        range: [range(f32::min), range(f32::max)],
        colorfulness: colorfulness(&rgb.collect::<Vec<_>>()),
        seconds,
    })
}
