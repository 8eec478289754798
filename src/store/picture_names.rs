//! Files of pictures of views, one a view whatever the views are called.

use std::collections::HashMap;

use crate::capture::{View, names::stem};

/// For each view the path of its picture below a folder: the view's name with the extension
/// `png` in the place of a picture's, or behind the full name where two would be one file.
pub(crate) fn picture_names(views: &[View]) -> Vec<String> {
    let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
    distinct(&names)
}

/// [`picture_names`] of names.
pub(crate) fn distinct(names: &[&str]) -> Vec<String> {
    let mut files: Vec<String> = (names.iter())
        .map(|name| format!("{}.png", stem(name)))
        .collect();
    // A full name may in turn be what a shorter one has become.
    for full in [
        |name: &str, _| format!("{name}.png"),
        |name: &str, _| format!("{name}.png"),
        |name: &str, place| format!("{name}-{place}.png"),
    ] {
        let mut counts = HashMap::<String, usize>::new();
        for file in &files {
            *counts.entry(file.to_lowercase()).or_default() += 1;
        }
        for (place, (file, name)) in files.iter_mut().zip(names).enumerate() {
            if counts[&file.to_lowercase()] > 1 {
                *file = full(name, place);
            }
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_apart() {
        for (names, expected) in [
            (&["a.jpg", "left/a.jpg"][..], &["a.png", "left/a.png"][..]),
            (
                &["a.jpg", "a.png", "b.tif"],
                &["a.jpg.png", "a.png.png", "b.png"],
            ),
            (
                &["frame_2.4", "frame_2.5"],
                &["frame_2.4.png", "frame_2.5.png"],
            ),
            // Not every disk tells these apart.
            (&["a.jpg", "A.jpg"], &["a.jpg-0.png", "A.jpg-1.png"]),
            (&["a.jpg", "A.tif"], &["a.jpg.png", "A.tif.png"]),
            (
                &["a@up.jpg", "a@up.png", "a@down.jpg"],
                &["a@up.jpg.png", "a@up.png.png", "a@down.png"],
            ),
            (
                &["a.jpg", "a.png", "a.jpg.png"],
                &["a.jpg.png", "a.png.png", "a.jpg.png.png"],
            ),
        ] {
            assert_eq!(distinct(names), expected);
        }
    }
}
