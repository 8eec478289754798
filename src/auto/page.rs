//! Page of a film's shots: a picture, the time, the camera and the outcome of each.

use std::{fmt::Write, path::Path};

use super::outcome::{Fallback, Outcome, Reel, ReelShot};
use crate::{
    prepare::{CameraMotion, span},
    programs::{FFMPEG, Program},
    report::html,
    store::{StoreError, files},
};

/// A shot's picture, in its folder.
const PICTURE: &str = "shot.jpg";

/// Writes the page: shots that are made, and times of those that are not.
pub(super) fn write(reel: &Reel, spans: &[[f64; 2]], film: &Path) -> Result<(), StoreError> {
    let folder = reel.page.parent().unwrap_or(Path::new("."));
    let name = film.file_name().unwrap_or_default().to_string_lossy();
    let mut html = html::head(&format!("{name}, shot by shot"));
    let _ = write!(html, "<h1>{}, shot by shot</h1>\n<p>", html::escaped(&name));
    html.push_str(match reel.shots.len() == spans.len() {
        true => "<a href=\"colored.mp4\">The whole film in color.</a> ",
        false => "The film in color is being made. ",
    });
    html.push_str(
        "Each shot is a scene of its own, so that the same thing may differ in color between two \
         shots. Where a cut is wrong, correct the times in <code>shots.json</code> and run the same \
         command again.</p>\n",
    );
    for (i, times) in spans.iter().enumerate() {
        let below = format!("shots/{:03}", i + 1);
        let _ = writeln!(html, "<h2>Shot {}, {}</h2>", i + 1, span(*times));
        let Some(shot) = reel.shots.get(i) else {
            html.push_str("<p>To be made.</p>\n");
            continue;
        };
        if folder.join(&below).join(PICTURE).is_file() {
            let _ = writeln!(
                html,
                "<p><a href=\"{below}/colored.mp4\"><img src=\"{below}/{PICTURE}\" alt=\"shot {} in gray and in color\" width=\"640\"></a></p>",
                i + 1
            );
        }
        let camera = shot.camera.map_or("", in_words);
        let _ = writeln!(
            html,
            "<p>{camera}{} Made in {:.0} s.</p>",
            result(shot, &below),
            shot.seconds
        );
    }
    html.push_str(html::TAIL);
    files::write(&reel.page, html.as_bytes())
}

fn in_words(camera: CameraMotion) -> &'static str {
    match camera {
        CameraMotion::Moves => "The camera moves. ",
        CameraMotion::Turns => "The camera turns. ",
        CameraMotion::Stands => "The camera stands. ",
    }
}

/// Outcome and warnings.
fn result(shot: &ReelShot, below: &str) -> String {
    let mut html = match &shot.outcome {
        Outcome::Scene(results) => {
            let measured = match results.page {
                Some(_) => format!(
                    "<a href=\"{below}/run/eval/{}\">measurements</a>, ",
                    files::PAGE
                ),
                None => String::new(),
            };
            format!(
                "Colored; {measured}<a href=\"{below}/run/contact-sheet.png\">contact sheet</a>."
            )
        }
        Outcome::Fallback { colors, reason } => {
            let colors = match colors {
                Fallback::Gray => "Left gray",
                Fallback::Teacher => "Colored by the teacher alone",
            };
            format!("{colors}: {}.", html::escaped(reason))
        }
        Outcome::Blank => "Shows nothing.".to_owned(),
    };
    if let Outcome::Scene(_) = shot.outcome {
        for warning in &shot.warnings {
            let _ = write!(html, "<br>Warning: {}.", html::escaped(warning));
        }
    }
    html
}

/// Makes the picture of a shot: the middle of it, gray and in color.
pub(super) fn picture(shot: &ReelShot, folder: &Path) {
    let [from, to] = shot.span;
    let path = folder.join(PICTURE);
    let both = "scale=480:-2,format=yuv444p,split[a][b];[a]hue=s=0[g];[g][b]hstack";
    let ffmpeg = Program::new(FFMPEG)
        .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
        .option("-ss", format!("{:.3}", (to - from) / 2.0))
        .option("-i", &shot.colored)
        .args(["-frames:v", "1", "-vf", both, "-q:v", "3"])
        .arg(&path);
    // A page without a picture is a page.
    let _made = ffmpeg.ask();
}
