//! The page of `eval`: one HTML file beside its pictures.

use std::fmt::Write;

use super::{
    Evaluation,
    html::{TAIL, escaped, head, push_table},
};

/// Colors of a map of errors, from none to [`MAP_END`] and beyond.
const RAMP: [[f64; 3]; 5] = [
    [0.06, 0.05, 0.12],
    [0.36, 0.10, 0.43],
    [0.76, 0.22, 0.36],
    [0.97, 0.55, 0.20],
    [0.99, 0.96, 0.70],
];

/// Error at the bright end of a map, in ΔE00 or CIELAB units: a difference that nobody
/// overlooks.
pub const MAP_END: f64 = 30.0;

/// A picture on the page.
pub struct Figure {
    /// Caption.
    pub caption: String,
    /// Its file, beside the page.
    pub file: String,
}

/// Pictures of one viewpoint.
pub struct PageRow {
    /// The photo's name, or the frame's.
    pub name: String,
    /// Left to right.
    pub figures: Vec<Figure>,
}

/// Error map, `[height, width]` of RGB in [0, 1]; non-finite errors are white.
pub fn error_map(errors: &[f64]) -> Vec<[f32; 3]> {
    let color = |&error: &f64| {
        if !error.is_finite() {
            return [1.0; 3];
        }
        let place = (error / MAP_END).clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
        let step = (place as usize).min(RAMP.len() - 2);
        let share = place - step as f64;
        std::array::from_fn(|c| (RAMP[step][c] * (1.0 - share) + RAMP[step + 1][c] * share) as f32)
    };
    errors.iter().map(color).collect()
}

/// The path in pictures.
pub struct Flight {
    /// Its frames, which lie beside the page as `frame-0000.png` and so on.
    pub frames: usize,
    /// Width and height of one in pixels.
    pub size: [u32; 2],
    /// Frames a second.
    pub rate: u32,
    /// A film of them beside the page.
    pub film: Option<String>,
    /// Bytes of the film; of all frames where there is none.
    pub bytes: u64,
    /// Some of its frames.
    pub rows: Vec<PageRow>,
}

/// Script of the page.
const SCRIPT: &str = include_str!("page.js");

/// The page's HTML: a verdict, tables, the path, and a row of pictures a view.
pub fn evaluation_page(evaluation: &Evaluation, flight: &Flight, views: &[PageRow]) -> String {
    let mut html = head("gs-chroma evaluation");
    // Writing to a string cannot fail.
    let _ = write!(
        html,
        "<h1>{}</h1>\n<p class=\"note\">gs-chroma {}{}</p>\n<ul class=\"verdict\">\n",
        escaped(&evaluation.scene),
        escaped(&evaluation.program),
        teacher_in_words(evaluation)
    );
    for line in evaluation.verdict() {
        let _ = writeln!(html, "<li>{}</li>", escaped(&line));
    }
    html.push_str("</ul>\n");
    for table in evaluation.tables() {
        push_table(&mut html, &table);
    }
    html.push_str("<h2>Along the path</h2>\n");
    push_flight(&mut html, flight);
    push_rows(&mut html, &flight.rows);
    html.push_str("<h2>View by view</h2>\n");
    let _ = writeln!(
        html,
        "<p class=\"note\">A picture opens large. Maps of errors: <span class=\"ramp\" style=\"background:linear-gradient(90deg,{})\"></span> from 0 to {MAP_END:.0} and beyond, in ΔE00 or CIELAB units.</p>",
        RAMP.map(|c| {
            let [r, g, b] = c.map(|v| (255.0 * v).round());
            format!("rgb({r},{g},{b})")
        })
        .join(",")
    );
    push_rows(&mut html, views);
    let _ = write!(html, "<script>\n{SCRIPT}</script>\n");
    html.push_str(TAIL);
    html
}

/// Viewpoints, each with its name and its pictures side by side.
fn push_rows(html: &mut String, rows: &[PageRow]) {
    for row in rows {
        let _ = writeln!(html, "<h3>{}</h3>\n<div class=\"row\">", escaped(&row.name));
        for figure in &row.figures {
            let _ = writeln!(
                html,
                "<figure><a href=\"{0}\"><img src=\"{0}\" alt=\"{1}\" loading=\"lazy\"></a><figcaption>{1}</figcaption></figure>",
                escaped(&figure.file),
                escaped(&figure.caption)
            );
        }
        html.push_str("</div>\n");
    }
}

/// The path as a film, or its first frame, from which the script goes on.
fn push_flight(html: &mut String, flight: &Flight) {
    let [width, height] = flight.size;
    let frames = flight.frames;
    let told = format!(
        "{frames} frames of {width}×{height} pixels, {:.1} MB",
        flight.bytes as f64 / 1e6
    );
    let _ = match &flight.film {
        Some(film) => writeln!(
            html,
            "<figure class=\"flight\"><video src=\"{}\" poster=\"frame-0000.png\" width=\"{width}\" height=\"{height}\" controls loop muted playsinline></video><figcaption>{told}</figcaption></figure>",
            escaped(film)
        ),
        None => writeln!(
            html,
            "<figure class=\"flight\" data-frames=\"{frames}\" data-rate=\"{}\"><a href=\"frame-0000.png\"><img src=\"frame-0000.png\" alt=\"the path\"></a><figcaption>{told}; with ffmpeg on the PATH they become a film</figcaption></figure>",
            flight.rate
        ),
    };
}

fn teacher_in_words(evaluation: &Evaluation) -> String {
    let name = evaluation.teacher.as_ref().and_then(|t| t["name"].as_str());
    name.map_or(String::new(), |name| format!("; teacher {}", escaped(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_goes_from_dark_to_bright() {
        let map = error_map(&[0.0, 7.5, MAP_END, 1e9, f64::NAN]);
        assert_eq!(map[0], RAMP[0].map(|v| v as f32));
        assert_eq!(map[1], RAMP[1].map(|v| v as f32));
        assert_eq!(map[2], RAMP[4].map(|v| v as f32));
        assert_eq!(map[3], map[2]);
        assert_eq!(map[4], [1.0; 3]);
    }
}
