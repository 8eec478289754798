//! Viewers' requirements on a splat file, and a reader that is not the crate's.

use super::oracle::scene::{Gaussian, Scene};
use super::program::Place;
use super::shared::{QUICK_FIT, onnx, place_with_run, place_with_scene};

/// A splat file: its header's lines and its rows of floats.
pub struct SplatFile {
    pub header: Vec<String>,
    pub rows: Vec<Vec<f32>>,
}

impl SplatFile {
    /// Takes the file apart: text with LF up to `end_header`, then floats.
    pub fn read(place: &Place, name: &str) -> Self {
        const END: &[u8] = b"end_header\n";
        let bytes = place.read(name);
        let end = END.len()
            + bytes
                .windows(END.len())
                .position(|window| window == END)
                .expect("a header");
        let text = std::str::from_utf8(&bytes[..end]).expect("text");
        assert!(text.is_ascii() && !text.contains('\r'));
        let header: Vec<String> = text.lines().map(str::to_owned).collect();
        let width = header
            .iter()
            .filter(|line| line.starts_with("property float "))
            .count();
        let floats: Vec<f32> = bytes[end..]
            .chunks(4)
            .map(|four| f32::from_le_bytes(four.try_into().expect("whole floats")))
            .collect();
        let rows: Vec<Vec<f32>> = floats.chunks(width).map(<[f32]>::to_vec).collect();
        let file = Self { header, rows };
        assert_eq!(file.rows.len(), file.count());
        assert!(file.rows.iter().all(|row| row.len() == width));
        file
    }

    /// The count in the header.
    pub fn count(&self) -> usize {
        let line = self
            .header
            .iter()
            .find_map(|line| line.strip_prefix("element vertex "));
        line.expect("a vertex element").parse().expect("a count")
    }

    /// Column of a property.
    pub fn place(&self, property: &str) -> usize {
        let line = format!("property float {property}");
        let names = self
            .header
            .iter()
            .filter(|line| line.starts_with("property"));
        let place = names.into_iter().position(|name| *name == line);
        place.unwrap_or_else(|| panic!("no property {property}"))
    }

    /// A property of every Gaussian.
    pub fn column(&self, property: &str) -> Vec<f32> {
        let place = self.place(property);
        self.rows.iter().map(|row| row[place]).collect()
    }

    /// The Gaussians for the oracle: coefficient `k` of channel `c` is `f_dc_c`
    /// or `f_rest_(c · (K − 1) + k − 1)`.
    pub fn to_oracle(&self) -> Scene<f64, 3> {
        let rest = self
            .header
            .iter()
            .filter(|line| line.contains("f_rest_"))
            .count()
            / 3;
        let degree = (rest as f64 + 1.0).sqrt() as usize - 1;
        let wide = |row: &[f32], from: usize, k: usize| f64::from(row[from + k]);
        let gaussians = self.rows.iter().map(|row| {
            let tail = 9 + 3 * rest;
            let mut sh = vec![std::array::from_fn(|c| wide(row, 6, c))];
            sh.extend((0..rest).map(|k| std::array::from_fn(|c| wide(row, 9, c * rest + k))));
            Gaussian {
                mean: std::array::from_fn(|k| wide(row, 0, k)),
                quat: std::array::from_fn(|k| wide(row, tail + 4, k)),
                log_scale: std::array::from_fn(|k| wide(row, tail + 1, k)),
                opacity_logit: wide(row, tail, 0),
                sh,
            }
        });
        Scene::of(degree, gaussians)
    }
}

/// The header's lines at a degree of the harmonics.
fn expected_header(count: usize, rest: usize) -> Vec<String> {
    let mut lines = vec![
        "ply".to_owned(),
        "format binary_little_endian 1.0".to_owned(),
        format!("comment gs-chroma {}", env!("CARGO_PKG_VERSION")),
        format!("element vertex {count}"),
    ];
    let names = [
        "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2",
    ];
    lines.extend(names.map(|name| format!("property float {name}")));
    lines.extend((0..rest).map(|i| format!("property float f_rest_{i}")));
    let names = [
        "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
    ];
    lines.extend(names.map(|name| format!("property float {name}")));
    lines.push("end_header".to_owned());
    lines
}

#[test]
fn header_and_numbers_are_what_viewers_want() {
    let place = place_with_run();
    place.succeed(&["export", "-o", "out.ply"]);
    for name in ["runs/scene/luma.ply", "runs/scene/color.ply", "out.ply"] {
        let file = SplatFile::read(&place, name);
        assert!(file.count() > 0);
        assert_eq!(file.header, expected_header(file.count(), 24), "{name}");
        assert!(file.rows.iter().flatten().all(|value| value.is_finite()));
        for row in &file.rows {
            assert_eq!(row[3..6], [0.0; 3], "normals");
            let squares: f32 = row[row.len() - 4..].iter().map(|q| q * q).sum();
            assert!(
                (squares - 1.0).abs() < 1e-5,
                "quaternion of length² {squares}"
            );
        }
        let gray = file.column("f_dc_0") == file.column("f_dc_2");
        assert_eq!(gray, name.contains("luma"), "{name}");
    }
}

#[test]
fn each_degree_has_its_properties() {
    let place = place_with_scene();
    for (luma, rest) in [("0", 0), ("1", 9), ("3", 45)] {
        place.succeed(&[&QUICK_FIT[..], &["--sh-degree", luma]].concat());
        let file = SplatFile::read(&place, "runs/scene/luma.ply");
        assert_eq!(file.header, expected_header(file.count(), rest));
    }
    // The colors' degree may exceed the luminance's.
    place.succeed(&[&QUICK_FIT[..], &["--sh-degree", "0"]].concat());
    let teacher = onnx("ddcolor_tiny.onnx");
    let colorize = [
        "colorize",
        "--solver",
        "adam",
        "--until",
        "5",
        "--sh-degree",
        "3",
        "--teacher",
    ];
    place.succeed(&[&colorize[..], &[&teacher]].concat());
    let file = SplatFile::read(&place, "runs/scene/color.ply");
    assert_eq!(file.header, expected_header(file.count(), 45));
}
