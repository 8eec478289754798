//! Color management: images of other color spaces become sRGB.

use image::{DynamicImage, Rgb32FImage, Rgba32FImage};
use moxcms::{
    CicpColorPrimaries, CicpProfile, ColorProfile, Layout, MatrixCoefficients, ProfileText,
    TransferCharacteristics, TransformF32Executor, TransformOptions,
};

use super::metadata::ImageMetadata;

/// Tolerance of each channel, 0 to 1, within which a color space counts as sRGB.
const SAME: f32 = 1.5 / 255.0;

/// The gamma that stands for sRGB, and how far one may be off to be it.
const SRGB_GAMMA: f32 = 0.45455;
const SAME_GAMMA: f32 = 0.02;

/// The code points of the transfer functions of high dynamic range: PQ and HLG.
const HIGH_DYNAMIC_RANGE: [u8; 2] = [16, 18];

/// A picture in sRGB by what its file says of its colors, and what is not heeded of that.
pub(super) fn in_srgb(
    image: DynamicImage,
    metadata: &ImageMetadata,
) -> (DynamicImage, Option<String>) {
    // Without a color there is none to become another.
    if !image.color().has_color() {
        return (image, None);
    }
    let (profile, name) = match metadata {
        ImageMetadata {
            code_points: Some([primaries, transfer]),
            ..
        } => (
            by_code_points(*primaries, *transfer),
            format!("cICP {primaries}, {transfer}"),
        ),
        ImageMetadata {
            profile: Some(profile),
            ..
        } => {
            let profile = ColorProfile::new_from_slice(profile).ok();
            let name = profile.as_ref().and_then(name).unwrap_or_default();
            (profile, name)
        }
        ImageMetadata {
            gamma: Some(gamma), ..
        } if (gamma - SRGB_GAMMA).abs() > SAME_GAMMA => (None, format!("gAMA {gamma}")),
        _ => return (image, None),
    };
    let layout = match image.color().has_alpha() {
        true => Layout::Rgba,
        false => Layout::Rgb,
    };
    let srgb = ColorProfile::new_srgb();
    let options = TransformOptions::default();
    let transform = profile.and_then(|profile| {
        let transform = profile.create_transform_f32(layout, &srgb, layout, options);
        transform.ok()
    });
    match transform {
        None => (image, Some(name)),
        Some(transform) if is_srgb(&*transform, layout) => (image, None),
        Some(transform) => match transformed(image, &*transform) {
            Ok(image) => (image, None),
            Err(image) => (image, Some(name)),
        },
    }
}

fn by_code_points(primaries: u8, transfer: u8) -> Option<ColorProfile> {
    if HIGH_DYNAMIC_RANGE.contains(&transfer) {
        return None;
    }
    let profile = CicpProfile {
        color_primaries: CicpColorPrimaries::try_from(primaries).ok()?,
        transfer_characteristics: TransferCharacteristics::try_from(transfer).ok()?,
        matrix_coefficients: MatrixCoefficients::Identity,
        full_range: true,
    };
    let profile = ColorProfile::new_from_cicp(profile);
    profile.red_trc.is_some().then_some(profile)
}

/// Description of an ICC profile.
fn name(profile: &ColorProfile) -> Option<String> {
    Some(match profile.description.as_ref()? {
        ProfileText::PlainString(name) => name.clone(),
        ProfileText::Localizable(names) => names.first()?.value.clone(),
        ProfileText::Description(name) => name.ascii_string.clone(),
    })
}

/// True if the profile changes no channel by more than 1.5 levels of 255.
fn is_srgb(transform: &TransformF32Executor, layout: Layout) -> bool {
    let levels = [0.0, 0.25, 0.5, 0.75, 1.0];
    let colors: Vec<f32> = (0..125)
        .flat_map(|i| {
            let color = [levels[i % 5], levels[i / 5 % 5], levels[i / 25], 1.0];
            color.into_iter().take(layout.channels())
        })
        .collect();
    let mut shown = vec![0.0; colors.len()];
    let done = transform.transform(&colors, &mut shown).is_ok();
    let near = |(a, b): (&f32, &f32)| (a - b.clamp(0.0, 1.0)).abs() <= SAME;
    done && colors.iter().zip(&shown).all(near)
}

/// The picture, or as it was where it cannot be transformed.
fn transformed(
    image: DynamicImage,
    transform: &TransformF32Executor,
) -> Result<DynamicImage, DynamicImage> {
    let [width, height] = [image.width(), image.height()];
    let has_alpha = image.color().has_alpha();
    let values = match has_alpha {
        true => image.to_rgba32f().into_raw(),
        false => image.to_rgb32f().into_raw(),
    };
    let mut shown = vec![0.0; values.len()];
    if transform.transform(&values, &mut shown).is_err() {
        return Err(image);
    }
    shown.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
    let shown = match has_alpha {
        true => Rgba32FImage::from_raw(width, height, shown).map(DynamicImage::from),
        false => Rgb32FImage::from_raw(width, height, shown).map(DynamicImage::from),
    };
    shown.ok_or(image)
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    /// Colors that all of these spaces have.
    fn picture() -> RgbImage {
        RgbImage::from_fn(16, 16, |x, y| {
            Rgb([60 + 8 * x as u8, 60 + 8 * y as u8, 120])
        })
    }

    /// The picture as a color space has it.
    fn saved_in(space: &ColorProfile) -> DynamicImage {
        let (srgb, rgb) = (ColorProfile::new_srgb(), Layout::Rgb);
        let options = TransformOptions::default();
        let transform = srgb
            .create_transform_8bit(rgb, space, rgb, options)
            .unwrap();
        let mut saved = picture();
        transform.transform(&picture(), &mut saved).unwrap();
        saved.into()
    }

    fn metadata(space: &ColorProfile) -> ImageMetadata {
        ImageMetadata {
            profile: Some(space.encode().unwrap()),
            ..ImageMetadata::default()
        }
    }

    #[test]
    fn pictures_of_other_color_spaces_become_srgb() {
        let p3 = ColorProfile::new_display_p3();
        let by_points = ImageMetadata {
            code_points: Some([12, 13]),
            ..ImageMetadata::default()
        };
        let adobe = ColorProfile::new_adobe_rgb();
        let wide = ColorProfile::new_pro_photo_rgb();
        for (space, metadata) in [
            (&adobe, metadata(&adobe)),
            (&wide, metadata(&wide)),
            (&p3, metadata(&p3)),
            (&p3, by_points),
        ] {
            let saved = saved_in(space);
            let far = |a: &RgbImage| {
                let channels = a.iter().zip(picture().into_raw());
                channels.map(|(a, b)| a.abs_diff(b)).max().unwrap()
            };
            assert!(far(&saved.to_rgb8()) > 6);
            let (shown, unheeded) = in_srgb(saved, &metadata);
            assert_eq!(unheeded, None);
            // Bytes of a wide space are coarse.
            assert!(far(&shown.to_rgb8()) <= 3, "{}", far(&shown.to_rgb8()));
        }
        // Nothing is lost of what is sRGB anyway.
        let srgb = metadata(&ColorProfile::new_srgb());
        let same = in_srgb(picture().into(), &srgb);
        assert_eq!(same, (picture().into(), None));
    }

    #[test]
    fn what_cannot_be_heeded_is_named() {
        let gray = metadata(&ColorProfile::new_gray_with_gamma(1.8));
        let of = |metadata: &ImageMetadata| in_srgb(picture().into(), metadata);
        assert!(of(&gray).1.is_some());
        let damaged = ImageMetadata {
            profile: Some(vec![7; 200]),
            ..ImageMetadata::default()
        };
        let gamma = |gamma| ImageMetadata {
            gamma: Some(gamma),
            ..ImageMetadata::default()
        };
        let bright = ImageMetadata {
            code_points: Some([9, 16]),
            ..ImageMetadata::default()
        };
        for metadata in [damaged, gamma(1.0), bright] {
            let (picture_shown, unheeded) = of(&metadata);
            assert!(unheeded.is_some() && picture_shown == picture().into());
        }
        assert_eq!(of(&gamma(0.45455)).1, None);
        // Gray has no colors that could be others.
        let luma = DynamicImage::from(picture()).into_luma8();
        assert_eq!(in_srgb(luma.into(), &gray).1, None);
    }
}
