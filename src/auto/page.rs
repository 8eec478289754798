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
        "Each shot is a scene of its own, so that the same thing may differ in color between two shots. \
         Where a cut is wrong, correct the times in <code>shots.json</code> and run the same command again.</p>\n\
         <table>\n<thead><tr><th>Shot</th><th>In the film and in color</th><th>Time</th><th>Camera</th><th>Result</th><th>Seconds</th></tr></thead>\n<tbody>\n",
    );
    for (i, times) in spans.iter().enumerate() {
        let below = format!("shots/{:03}", i + 1);
        let _ = write!(html, "<tr><td>{}</td>", i + 1);
        let Some(shot) = reel.shots.get(i) else {
            let _ = writeln!(
                html,
                "<td></td><td>{}</td><td></td><td>to be made</td><td></td></tr>",
                span(*times)
            );
            continue;
        };
        let picture = match folder.join(&below).join(PICTURE).is_file() {
            true => format!(
                "<a href=\"{below}/colored.mp4\"><img src=\"{below}/{PICTURE}\" alt=\"shot {}\" width=\"480\"></a>",
                i + 1
            ),
            false => String::new(),
        };
        let _ = writeln!(
            html,
            "<td>{picture}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0}</td></tr>",
            span(*times),
            shot.camera.map_or("", in_words),
            result(shot, &below),
            shot.seconds
        );
    }
    html.push_str("</tbody></table>\n");
    html.push_str(html::TAIL);
    files::write(&reel.page, html.as_bytes())
}

fn in_words(camera: CameraMotion) -> &'static str {
    match camera {
        CameraMotion::Moves => "moves",
        CameraMotion::Turns => "turns",
        CameraMotion::Stands => "stands",
    }
}

/// Outcome and warnings.
fn result(shot: &ReelShot, below: &str) -> String {
    let mut html = match &shot.outcome {
        Outcome::Scene(_) => format!(
            "colored; <a href=\"{below}/run/eval/{}\">measurements</a>, <a href=\"{below}/run/contact-sheet.png\">contact sheet</a>",
            files::PAGE
        ),
        Outcome::Fallback { colors, reason } => {
            let colors = match colors {
                Fallback::Gray => "left gray",
                Fallback::Teacher => "colored by the teacher alone",
            };
            format!("{colors}: {}", html::escaped(reason))
        }
        Outcome::Blank => "shows nothing".to_owned(),
    };
    if let Outcome::Scene(_) = shot.outcome {
        for warning in &shot.warnings {
            let _ = write!(html, "<br>{}", html::escaped(warning));
        }
    }
    html
}

/// Makes the picture of a shot: the middle of it, gray and in color.
pub(super) fn picture(shot: &ReelShot, folder: &Path) {
    let [from, to] = shot.span;
    let path = folder.join(PICTURE);
    let both = "scale=480:-2,split[a][b];[a]format=gray,format=yuvj444p[g];[b]format=yuvj444p[c];[g][c]hstack";
    let ffmpeg = Program::new(FFMPEG)
        .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
        .option("-ss", format!("{:.3}", (to - from) / 2.0))
        .option("-i", &shot.colored)
        .args(["-frames:v", "1", "-vf", both, "-q:v", "3"])
        .arg(&path);
    // A page without a picture is a page.
    let _made = ffmpeg.ask();
}
