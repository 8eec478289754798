//! The archive and its `meta.json`, against the specification and not against the writer.

use std::{
    collections::BTreeSet,
    io::{Cursor, Read, Write},
    path::Path,
};

use serde_json::{Value, json};
use zip::{ZipArchive, ZipWriter, write::SimpleFileOptions};

use super::{texture::Texture, *};
use crate::splats::{ReadSplats, SplatError, Splats, WriteOptions, fixtures::scattered};

fn archive(splats: &Splats) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.sog");
    let options = WriteOptions {
        generator: "gs-chroma 0".to_owned(),
        antialiased: true,
        ..WriteOptions::default()
    };
    crate::splats::write_splats(&path, splats, &options).unwrap();
    std::fs::read(path).unwrap()
}

fn file(archive: &[u8], name: &str) -> Vec<u8> {
    let mut archive = ZipArchive::new(Cursor::new(archive)).unwrap();
    let mut bytes = Vec::new();
    archive
        .by_name(name)
        .unwrap()
        .read_to_end(&mut bytes)
        .unwrap();
    bytes
}

fn meta(archive: &[u8]) -> Value {
    serde_json::from_slice(&file(archive, "meta.json")).unwrap()
}

/// The archive with a file replaced.
fn with(sound: &[u8], name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut archive = ZipArchive::new(Cursor::new(sound)).unwrap();
    let names: Vec<String> = archive.file_names().map(str::to_owned).collect();
    let mut other = ZipWriter::new(Cursor::new(Vec::new()));
    for own in names {
        other
            .start_file(&own, SimpleFileOptions::default())
            .unwrap();
        match own == name {
            true => other.write_all(bytes).unwrap(),
            false => {
                let mut old = Vec::new();
                archive
                    .by_name(&own)
                    .unwrap()
                    .read_to_end(&mut old)
                    .unwrap();
                other.write_all(&old).unwrap();
            }
        }
    }
    other.finish().unwrap().into_inner()
}

fn read_archive(bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    read(Path::new("scene.sog"), bytes)
}

#[test]
fn the_archive_is_what_the_specification_wants() {
    let splats = scattered(100, 2);
    let bytes = archive(&splats);
    let meta = meta(&bytes);
    assert_eq!((&meta["version"], &meta["count"]), (&json!(2), &json!(100)));
    assert_eq!(
        (&meta["antialias"], &meta["model"]),
        (&json!(true), &json!("antialiased"))
    );
    assert_eq!(meta["asset"]["generator"], "gs-chroma 0");
    for part in ["scales", "sh0", "shN"] {
        assert_eq!(meta[part]["codebook"].as_array().unwrap().len(), 256);
    }
    assert_eq!(
        (&meta["shN"]["bands"], &meta["shN"]["count"]),
        (&json!(2), &json!(64))
    );
    let parts = ["means", "scales", "quats", "sh0", "shN"];
    let named = parts
        .iter()
        .flat_map(|part| meta[part]["files"].as_array().unwrap());
    let mut named: BTreeSet<&str> = named.map(|name| name.as_str().unwrap()).collect();
    named.insert("meta.json");
    let archive = ZipArchive::new(Cursor::new(&bytes[..])).unwrap();
    assert_eq!(named, archive.file_names().collect());

    // The first Gaussian's place, by the formulas of the specification.
    let pixel = |name: &str| {
        Texture::decode(&file(&bytes, name), [100, 1000])
            .unwrap()
            .rgba[0]
    };
    let (low, high) = (pixel("means_l.webp"), pixel("means_u.webp"));
    let place = [0, 1, 2].map(|axis| {
        let bound = |name: &str| meta["means"][name][axis].as_f64().unwrap();
        let level = f64::from(u16::from(high[axis]) << 8 | u16::from(low[axis]));
        let n = bound("mins") + (bound("maxs") - bound("mins")) * level / 65535.0;
        n.signum() * (n.abs().exp() - 1.0)
    });
    let near = |mean: &&[f32; 3]| (0..3).all(|k| (f64::from(mean[k]) - place[k]).abs() < 1e-3);
    let index = splats
        .means
        .iter()
        .position(|mean| near(&mean))
        .expect("a Gaussian");
    let [a, b, c, mode] = pixel("quats.webp");
    let component = |byte: u8| (f64::from(byte) / 255.0 - 0.5) * 2.0 / 2.0_f64.sqrt();
    let mut found = vec![component(a), component(b), component(c)];
    let rest: f64 = found.iter().map(|v| v * v).sum();
    found.insert(usize::from(mode - 252), (1.0 - rest).sqrt());
    let dot: f64 = (0..4)
        .map(|k| found[k] * f64::from(splats.quats[index][k]))
        .sum();
    assert!(dot.abs() > 0.9999, "{dot}");
    let label = pixel("shN_labels.webp");
    let label = usize::from(label[0]) + 256 * usize::from(label[1]);
    let palette = Texture::decode(&file(&bytes, "shN_centroids.webp"), [512, 512]).unwrap();
    assert_eq!(palette.width, 64 * 8);
    let red = palette.rgba[(label / 64) * 512 + (label % 64) * 8][0];
    let red = meta["shN"]["codebook"][usize::from(red)].as_f64().unwrap();
    assert!((red - f64::from(splats.sh.of(index)[3])).abs() < 1.2);
}

#[test]
fn other_writers_files_are_read() {
    let bytes = archive(&scattered(40, 1));
    let mut other = meta(&bytes);
    for key in ["antialias", "asset", "model"] {
        other.as_object_mut().unwrap().remove(key);
    }
    other["new"] = json!({ "to come": 1 });
    let found = read_archive(&with(&bytes, "meta.json", &other.to_string().into_bytes())).unwrap();
    assert!(!found.antialiased);
    assert_eq!(found.splats, read_archive(&bytes).unwrap().splats);
}

#[test]
fn what_is_wrong_is_named() {
    let bytes = archive(&scattered(40, 1));
    let sound = meta(&bytes);
    let refused = |bytes: &[u8], words: &str| {
        let message = read_archive(bytes).unwrap_err().to_string();
        assert!(
            message.starts_with("scene.sog: ") && message.contains(words),
            "{message}"
        );
        assert!(!message.contains('\n'), "{message}");
    };
    let changed = |pointer: &str, value: Value| {
        let mut other = sound.clone();
        *other.pointer_mut(pointer).expect("a key") = value;
        with(&bytes, "meta.json", &other.to_string().into_bytes())
    };
    refused(&changed("/version", json!(1)), "meta.json: version 1");
    refused(&changed("/count", json!(10_000_000)), "more than");
    refused(&changed("/count", json!(-1)), "meta.json");
    refused(&changed("/count", json!(200)), "means_l.webp: 8x8 pixels");
    refused(
        &changed("/scales/codebook", json!([1.0])),
        "a codebook has 1 entries",
    );
    refused(&changed("/quats/files/0", json!("../x")), "quats: ../x");
    refused(
        &changed("/shN/bands", json!(4)),
        "shN: 32 entries of 4 bands",
    );
    refused(&changed("/shN/count", json!(70_000)), "shN: 70000 entries");
    refused(&changed("/shN/count", json!(1)), "label of pixel");
    refused(&changed("/shN/bands", json!(2)), "shN");
    refused(&with(&bytes, "sh0.webp", b"RIFF"), "sh0: sh0.webp");
    refused(
        &with(&bytes, "meta.json", &vec![b' '; 2 << 20]),
        "more than 1048576 bytes",
    );
    let opaque = Texture::for_splats(40).encode().unwrap();
    refused(
        &with(
            &bytes,
            "scales.webp",
            &Texture::black(4, 4).encode().unwrap(),
        ),
        "4x4 pixels",
    );
    let mut transparent = Texture::for_splats(40);
    transparent.rgba[3][3] = 7;
    refused(
        &with(&bytes, "quats.webp", &transparent.encode().unwrap()),
        "alpha 7 of pixel 3",
    );
    // Of one color, and as large as WebP has pictures.
    let huge = Texture::black(16_000, 2000).encode().unwrap();
    assert!(huge.len() < 100_000 && opaque.len() < 1000);
    refused(&with(&bytes, "scales.webp", &huge), "16000x2000 pixels");
}
