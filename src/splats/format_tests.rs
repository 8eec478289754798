//! Fidelity of every format, and its warnings.

use std::{fs, path::Path};

use glam::DVec3;

use super::{
    Format, ReadSplats, SplatError, Splats, WriteOptions, fixtures::scattered, quantize,
    read_splats, sh::C0, write_splats,
};

/// A file as it was written, and the doubts.
fn written(name: &str, splats: &Splats, options: &WriteOptions) -> (Vec<u8>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let doubts = write_splats(&path, splats, options).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    (fs::read(path).unwrap(), doubts)
}

fn read(name: &str, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    read_splats(&path)
}

/// The largest errors that a format's bits allow for [`scattered`].
struct Bounds {
    /// World units.
    center: f64,
    /// Error of log-scales.
    scale: f64,
    /// 1 less the magnitude of the product of two quaternions.
    rotation: f64,
    /// Error of the color shown, 0 to 1.
    color: f64,
    /// Error of harmonics above degree 0; `None` without any.
    harmonic: Option<f64>,
}

/// Half a step of an angle's three components at most, as what is lacking of a product of 1:
/// about half the square of the distance, of which three components and the fourth, that
/// follows from them and is the largest, make no more than 3 · (1 + 3) half steps' squares.
fn rotation(step: f64) -> f64 {
    6.0 * (step / 2.0).powi(2)
}

fn bounds(format: Format) -> Bounds {
    let small = 2.0_f64.sqrt();
    match format {
        Format::Ply => Bounds {
            center: 0.0,
            scale: 0.0,
            rotation: 1e-6,
            color: 0.0,
            harmonic: Some(0.0),
        },
        // A chunk is no larger than the scene: 8 units and 3 of logarithms in 2^10 steps.
        Format::CompressedPly => Bounds {
            center: 0.5 * 8.0 / 1023.0,
            scale: 0.5 * 3.0 / 1023.0,
            rotation: rotation(small / 1023.0),
            color: 0.5 * 3.2 * C0 / 255.0,
            harmonic: Some(4.0 / 256.0),
        },
        Format::Splat => Bounds {
            center: 0.0,
            scale: 1e-6,
            rotation: rotation(1.0 / 128.0) + 1e-4,
            color: 0.5 / 255.0,
            harmonic: None,
        },
        Format::Spz => Bounds {
            // A 256th of the scale of a small one, which is no more than e^-3.
            center: 0.5 * (-3.0_f64).exp() / 256.0,
            scale: 0.5 / 16.0,
            rotation: rotation(1.0 / (small * 511.0)),
            color: 0.5 / 255.0 * C0 / 0.15,
            harmonic: Some(0.5 / 128.0),
        },
        // 16 bits of the logarithm, whose slope is 5 at 4 units. Codebooks fit the numbers: no
        // entry is farther than a few even steps. The palette is judged by itself.
        Format::Sog => Bounds {
            center: 0.5 * 2.0 * 5.0_f64.ln() / 65535.0 * 5.0,
            scale: 3.0 / 256.0,
            rotation: rotation(small / 255.0),
            color: 3.2 * C0 / 256.0,
            harmonic: Some(1.2),
        },
        Format::Glb | Format::Usda => unreachable!("not read"),
    }
}

/// Formats that are read.
fn readable() -> impl Iterator<Item = Format> {
    Format::ALL.into_iter().filter(|format| format.is_read())
}

/// The Gaussians of `found` in the order of `wanted`: formats may have their own.
fn matched(wanted: &Splats, found: &Splats) -> Vec<usize> {
    let near = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>();
    let nearest = |mean: &[f32; 3]| {
        (0..found.len())
            .min_by(|&a, &b| near(mean, &found.means[a]).total_cmp(&near(mean, &found.means[b])))
            .expect("a Gaussian")
    };
    let places: Vec<usize> = wanted.means.iter().map(nearest).collect();
    let mut sorted = places.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), wanted.len(), "each has its own");
    places
}

#[test]
fn what_is_read_back_is_within_the_bits() {
    for format in readable() {
        for degree in 0..=3 {
            let splats = scattered(300, degree);
            let options = WriteOptions::default();
            let name = format!("scene{}", format.extension());
            let (bytes, doubts) = written(&name, &splats, &options);
            let lost = degree > 0 && !format.has_harmonics();
            assert_eq!(doubts.len(), usize::from(lost), "{doubts:?}");
            let read = read(&name, &bytes).unwrap();
            assert_eq!((read.skipped, read.surplus), (0, 0));
            let found = read.splats;
            let bounds = bounds(format);
            let expected = if bounds.harmonic.is_some() { degree } else { 0 };
            assert_eq!(found.sh.degree, expected, "{name}");
            let mut worst = [0.0_f64; 6];
            for (index, place) in matched(&splats, &found).into_iter().enumerate() {
                let mut see = |kind: usize, a: f64, b: f64| {
                    worst[kind] = worst[kind].max((a - b).abs());
                };
                for k in 0..3 {
                    see(
                        0,
                        splats.means[index][k].into(),
                        found.means[place][k].into(),
                    );
                    let [a, b] = [splats.log_scales[index][k], found.log_scales[place][k]];
                    see(1, a.into(), b.into());
                }
                let (p, q) = (splats.quats[index], found.quats[place]);
                let norm = |q: [f32; 4]| q.iter().map(|v| f64::from(v * v)).sum::<f64>().sqrt();
                let dot: f64 = (0..4).map(|k| f64::from(p[k]) * f64::from(q[k])).sum();
                see(2, dot.abs() / norm(p) / norm(q), 1.0);
                let opacity = |logit: f32| 1.0 / (1.0 + (-f64::from(logit)).exp());
                let logits = [splats.opacity_logits[index], found.opacity_logits[place]];
                see(3, opacity(logits[0]), opacity(logits[1]));
                let (a, b) = (splats.sh.of(index), found.sh.of(place));
                for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
                    match k < 3 {
                        true => see(4, C0 * f64::from(a), C0 * f64::from(b)),
                        false => see(5, a.into(), b.into()),
                    }
                }
            }
            let opacity = if format == Format::Ply {
                0.0
            } else {
                0.5 / 255.0
            };
            let allowed = [
                bounds.center,
                bounds.scale,
                bounds.rotation,
                opacity,
                bounds.color,
                bounds.harmonic.unwrap_or(0.0),
            ];
            for (kind, (worst, allowed)) in worst.iter().zip(allowed).enumerate() {
                // Rounding of 32-bit floats.
                assert!(
                    *worst <= allowed + 3e-6,
                    "{name} {degree} {kind}: {worst} {allowed}"
                );
            }
        }
    }
}

#[test]
fn the_same_gaussians_give_the_same_bytes() {
    let splats = scattered(1500, 3);
    for format in Format::ALL {
        let name = format!("scene{}", format.extension());
        let [one, other] = [0, 1].map(|_| written(&name, &splats, &WriteOptions::default()).0);
        assert!(one == other, "{name}");
    }
}

#[test]
fn what_is_read_back_is_written_alike() {
    // What a format keeps it keeps for good; palettes and bounds are chosen anew.
    for format in readable() {
        if matches!(format, Format::CompressedPly | Format::Sog | Format::Splat) {
            continue;
        }
        let options = WriteOptions::default();
        let name = format!("scene{}", format.extension());
        let (bytes, _) = written(&name, &scattered(200, 2), &options);
        let back = read(&name, &bytes).unwrap().splats;
        let again = read(&name, &written(&name, &back, &options).0)
            .unwrap()
            .splats;
        for (a, b) in back.means.iter().zip(&again.means) {
            assert_eq!(a, b, "{name}");
        }
        assert_eq!(back.sh, again.sh, "{name}");
    }
}

#[test]
fn how_to_draw_and_what_was_subtracted_is_said() {
    let offset = DVec3::new(456_789.125, 5_412_345.0, -97.1);
    for format in readable() {
        for antialiased in [false, true] {
            let options = WriteOptions {
                generator: "gs-chroma 0".to_owned(),
                antialiased,
                offset,
                ..WriteOptions::default()
            };
            let name = format!("scene{}", format.extension());
            let (bytes, doubts) = written(&name, &scattered(10, 0), &options);
            let read = read(&name, &bytes).unwrap();
            let said = antialiased && format.tells_antialiasing();
            assert_eq!(read.antialiased, said, "{name}");
            assert_eq!(
                doubts.len(),
                usize::from(antialiased && !said),
                "{doubts:?}"
            );
            let expected = if format.tells_offset() {
                offset
            } else {
                DVec3::ZERO
            };
            assert_eq!(read.offset, expected, "{name}");
        }
    }
}

#[test]
fn none_and_one_gaussian() {
    for format in Format::ALL {
        for count in [0, 1] {
            let splats = scattered(count, 1);
            let name = format!("scene{}", format.extension());
            let (bytes, _) = written(&name, &splats, &WriteOptions::default());
            if format.is_read() {
                let found = read(&name, &bytes).unwrap().splats;
                assert_eq!(found.len(), count, "{name}");
            }
        }
    }
}

#[test]
fn gray_becomes_rgb_and_centers_are_moved_in_double() {
    let gray = scattered(30, 1).to_luma();
    let added = DVec3::new(1e6, 0.0, 0.0);
    for format in [Format::Splat, Format::CompressedPly] {
        let name = format!("scene{}", format.extension());
        let (bytes, _) = written(
            &name,
            &gray,
            &WriteOptions {
                added,
                ..WriteOptions::default()
            },
        );
        let found = read(&name, &bytes).unwrap().splats;
        assert!(found.is_gray(0.5 / 255.0 / C0 as f32 + 1e-6), "{name}");
        assert!(found.means.iter().all(|mean| (mean[0] - 1e6).abs() < 5.0));
    }
}

#[test]
fn what_cannot_be_written_is_refused_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, splats: &Splats| {
        let path = folder.path().join(name);
        let message = write_splats(&path, splats, &WriteOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(name) && !message.contains('\n'),
            "{message}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{name}");
        message
    };
    let mut bad = scattered(4, 0);
    bad.log_scales[2][1] = f32::NAN;
    for format in Format::ALL {
        let message = refused(&format!("scene{}", format.extension()), &bad);
        assert!(message.contains("the scale of splat 2 is NaN"), "{message}");
    }
    let unknown = refused("scene.obj", &scattered(4, 0));
    assert!(
        unknown.contains("those known are .compressed.ply, .ply"),
        "{unknown}"
    );
    // Far apart: steps of 24 or 16 bits are larger than the Gaussians.
    let mut far = scattered(40, 0);
    far.means.iter_mut().for_each(|mean| mean[0] *= 1e7);
    for name in ["scene.spz", "scene.sog"] {
        assert!(refused(name, &far).contains("would move 40 of 40 Gaussians"));
    }
    far.means.iter_mut().for_each(|mean| mean[0] *= 1e7);
    assert!(refused("scene.spz", &far).contains("write a .ply"));
}

#[test]
fn what_is_beyond_a_range_is_told() {
    let mut splats = scattered(100, 1);
    let told = |splats: &Splats, name: &str| written(name, splats, &WriteOptions::default()).1;
    for index in 0..5 {
        splats.sh.coefficients[index * 12 + 7] = 4.5;
    }
    for name in ["a.spz", "a.compressed.ply"] {
        let told = told(&splats, name);
        assert!(
            told[0].contains("5 of 100 Gaussians have harmonics"),
            "{told:?}"
        );
    }
    assert!(told(&splats, "a.sog").is_empty());
    let mut small = scattered(100, 0);
    // Wholly below 2^-14; and flat ones, which are nothing to worry about.
    (small.log_scales.iter_mut().take(7)).for_each(|scales| *scales = [-12.0; 3]);
    (small.log_scales.iter_mut().skip(50)).for_each(|scales| scales[0] = quantize::FLAT);
    let told = told(&small, "a.spz");
    let scales = "7 of 100 Gaussians have scales beyond its range";
    assert!(told.iter().any(|told| told.contains(scales)), "{told:?}");
    // They are smaller than a step of centers, too.
    assert_eq!(told.len(), 2);
}

#[test]
fn damaged_files_name_the_part() {
    let splats = scattered(50, 2);
    let files = readable().map(|format| {
        let name = format!("scene{}", format.extension());
        let options = WriteOptions::default();
        let (bytes, _) = written(&name, &splats, &options);
        (name, bytes)
    });
    for (name, bytes) in files {
        for share in [0.0, 0.01, 0.3, 0.7, 0.999] {
            let length = (bytes.len() as f64 * share) as usize;
            match read(&name, &bytes[..length]) {
                // Whole rows are a whole file.
                Ok(found) => assert!(name == "scene.splat" && found.splats.len() <= 50),
                Err(error) => {
                    let message = error.to_string();
                    assert!(message.contains(&name), "{message}");
                    assert!(!message.contains('\n'), "{message}");
                }
            }
        }
    }
    let message = |name: &str, bytes: &[u8]| read(name, bytes).unwrap_err().to_string();
    assert!(message("a.splat", &[0; 33]).contains("size: 33 bytes"));
    assert!(message("a.spz", b"NGSP").contains("header: it is cut off"));
    assert!(message("a.sog", b"PK").contains("zip archive"));
    // A text that says it is compressed.
    let text = b"ply\nformat ascii 1.0\nelement chunk 0\nelement vertex 0\nproperty uint packed_position\nend_header\n";
    assert!(message("a.ply", text).contains("never text"));
}

#[test]
fn a_name_is_all_that_tells_a_format() {
    let (bytes, _) = written(
        "a.compressed.ply",
        &scattered(9, 1),
        &WriteOptions::default(),
    );
    assert_eq!(read("renamed.ply", &bytes).unwrap().splats.len(), 9);
    let missing = read_splats(Path::new("nowhere.spz")).unwrap_err();
    assert!(missing.to_string().starts_with("nowhere.spz: "));
}
