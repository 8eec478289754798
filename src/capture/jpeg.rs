//! What a JPEG file's markers tell and its decoder keeps to itself.

/// The structure of a complete JPEG file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Bits per component.
    pub precision: u8,
    /// Color components: 1 gray, 3 color, 4 CMYK or YCCK.
    pub components: u8,
}

/// Walks the markers of a JPEG file (ITU-T T.81, annex B) from its start to the
/// end-of-image marker.
///
/// Decoders fill what a cut-off file lacks with gray and call it a success, and
/// turn CMYK into RGB without its profile: neither is a photo to train on.
/// `None` if the markers end early or name no frame.
pub(super) fn inspect(file: &[u8]) -> Option<Frame> {
    // In the range of the frame markers, but Huffman tables, an extension and
    // arithmetic conditioning.
    const NO_FRAMES: [u8; 3] = [0xc4, 0xc8, 0xcc];
    let mut frame = None;
    let mut rest = file.strip_prefix(&[0xff, 0xd8])?;
    loop {
        // Between markers lies entropy-coded data, in which 0xff is followed
        // by 0 or a restart marker; 0xff itself may be repeated as filling.
        let at = rest.iter().position(|&byte| byte == 0xff)?;
        rest = &rest[at + 1..];
        let marker = *rest.first()?;
        match marker {
            0x00 | 0x01 | 0xd0..=0xd7 => rest = &rest[1..],
            0xff => {}
            0xd9 => return frame,
            _ => {
                let length = u16::from_be_bytes([*rest.get(1)?, *rest.get(2)?]);
                let segment = rest.get(1..1 + usize::from(length).max(2))?;
                if (0xc0..=0xcf).contains(&marker) && !NO_FRAMES.contains(&marker) {
                    frame = Some(Frame {
                        precision: *segment.get(2)?,
                        components: *segment.get(7)?,
                    });
                }
                rest = &rest[1 + segment.len()..];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;

    fn jpeg(color: image::ExtendedColorType, components: usize) -> Vec<u8> {
        let mut file = Vec::new();
        let pixels: Vec<u8> = (0..32 * 24 * components).map(|i| (i * 7) as u8).collect();
        JpegEncoder::new(&mut file)
            .encode(&pixels, 32, 24, color)
            .unwrap();
        file
    }

    #[test]
    fn finds_the_frame() {
        let gray = jpeg(image::ExtendedColorType::L8, 1);
        let color = jpeg(image::ExtendedColorType::Rgb8, 3);
        assert_eq!(
            inspect(&gray),
            Some(Frame {
                precision: 8,
                components: 1
            })
        );
        assert_eq!(inspect(&color).map(|f| f.components), Some(3));
    }

    #[test]
    fn every_cut_is_noticed() {
        let file = jpeg(image::ExtendedColorType::Rgb8, 3);
        for end in 0..file.len() {
            assert_eq!(inspect(&file[..end]), None, "cut at {end}");
        }
        assert_eq!(inspect(b"\x89PNG"), None);
    }
}
