//! The path on the page of `eval`: its frames, and a film of them.

use std::{fs, path::Path};

use image::RgbImage;

use super::RunError;
use crate::{
    capture::{Camera, Orientation},
    eval::{Detected, Detector, Drawing, Painter, Progress, Shot, along_path},
    programs::ProgramError,
    report::{Figure, Flight, Method, PageRow, PathScore, to_image},
    store::{
        StoreError, files,
        film::{FilmWriter, Purpose},
    },
    tell::{Event, Observer},
};

/// Frames a second: slow enough to see what changes between two of them.
const RATE: u32 = 12;

/// Its file.
const FILM: &str = "flight.mp4";

/// Frames whose pictures are shown side by side.
const SHOWN: usize = 6;

/// Becomes a film where one can be made.
pub(super) struct FlightOutput<'a> {
    page: &'a Path,
    /// Folder for the gray frames.
    gray: Option<&'a Path>,
    /// Every so many frames are shown side by side.
    every: usize,
    rows: Vec<PageRow>,
    writer: Option<FilmWriter>,
    /// Error of the film's writer.
    failed: Option<String>,
}

impl<'a> FlightOutput<'a> {
    /// In the folder of a page, for a path of so many frames.
    pub fn begin(page: &'a Path, gray: Option<&'a Path>, frames: usize) -> Self {
        // Where nothing makes films, the page says so.
        let (writer, failed) = match FilmWriter::new(&page.join(FILM), [RATE, 1], Purpose::Viewing)
        {
            Ok(writer) => (Some(writer), None),
            Err(ProgramError::Missing { .. }) => (None, None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self {
            page,
            gray,
            every: frames.div_ceil(SHOWN),
            rows: Vec::new(),
            writer,
            failed,
        }
    }

    /// Draws, measures and writes the path.
    pub fn draw(
        mut self,
        painter: &mut Painter<'_>,
        cameras: &[Camera],
        flow: Option<&Path>,
        mut detector: Option<Detector>,
        observe: &mut Observer<'_>,
    ) -> Result<(PathScore, Flight), RunError> {
        let mut detected = Detected::default();
        let mut keep = |index, drawing: &Drawing| {
            if let Some(detector) = &mut detector {
                detected.add(detector, drawing)?;
            }
            self.add(index, drawing)
        };
        let mut told = |progress: Progress<'_>| observe(Event::from(progress));
        let mut path = along_path(painter, cameras, flow, &mut told, &mut keep)?;
        path.detections = detected.scores();
        if !path.skipped.is_empty() {
            observe(Event::Warning(format!(
                "a path of {} frames is too short for Δ = {:?}: choose more",
                path.frames, path.skipped
            )));
        }
        let flight = self.end(&path, observe);
        Ok((path, flight))
    }

    fn add(&mut self, index: usize, drawing: &Drawing) -> Result<(), RunError> {
        let size = [drawing.gray.width, drawing.gray.height];
        let image = |pixels: &[[f32; 3]]| to_image(size[0], size[1], pixels);
        let (name, file) = (format!("frame {index}"), format!("frame-{index:04}"));
        let frame = format!("{file}.png");
        if let Some(layer) = drawing.layer(&Method::Exported) {
            let picture = image(&layer.rgb(&drawing.gray));
            files::write_png(&self.page.join(&frame), &picture)?;
            self.film(&frame, &picture);
        }
        if let Some(folder) = self.gray {
            files::write_png(&folder.join(&frame), &image(&drawing.gray.shown()))?;
        }
        if index.is_multiple_of(self.every) {
            let pictures = drawing.pictures().into_iter();
            let shots: Vec<Shot> = pictures
                .map(|(method, pixels)| Shot::of(&method, pixels))
                .collect();
            let upright = Orientation::default();
            let row = page_row(self.page, [&name, &file], size, &shots, upright)?;
            self.rows.push(row);
        }
        Ok(())
    }

    fn film(&mut self, name: &str, frame: &RgbImage) {
        if let Some(mut writer) = self.writer.take() {
            match writer.write(name, frame) {
                Ok(()) => self.writer = Some(writer),
                Err(error) => self.failed = Some(reason(error)),
            }
        }
    }

    /// Finishes the path's part of the page: a film if one could be made, else its frames.
    fn end(mut self, path: &PathScore, observe: &mut Observer<'_>) -> Flight {
        let page = self.page;
        let made = self.writer.take().is_some_and(|writer| {
            let ended = writer.finish(observe);
            self.failed = ended.err().map(reason);
            self.failed.is_none() && page.join(FILM).is_file()
        });
        if let Some(reason) = self.failed {
            observe(Event::Warning(format!("no film of the path: {reason}")));
        }
        let film = made.then(|| FILM.to_owned());
        let bytes_of = |name: &str| fs::metadata(page.join(name)).map_or(0, |file| file.len());
        let of_frames = || (0..path.frames).map(|k| bytes_of(&format!("frame-{k:04}.png")));
        Flight {
            frames: path.frames,
            size: path.size,
            rate: RATE,
            bytes: match &film {
                Some(film) => bytes_of(film),
                None => of_frames().sum(),
            },
            film,
            rows: self.rows,
        }
    }
}

/// Writes a viewpoint's pictures beside the page, upright, with names that begin with `file`.
pub(super) fn page_row(
    page: &Path,
    [name, file]: [&str; 2],
    [width, height]: [u32; 2],
    shots: &[Shot],
    upright: Orientation,
) -> Result<PageRow, StoreError> {
    let mut figures = Vec::new();
    for shot in shots {
        let file = format!("{file}-{}.png", shot.file);
        let image = to_image(width, height, &shot.pixels).into();
        files::write_png(&page.join(&file), &upright.image(image).into_rgb8())?;
        figures.push(Figure {
            caption: shot.caption.clone(),
            file,
        });
    }
    Ok(PageRow {
        name: name.to_owned(),
        figures,
    })
}

/// Reason of an error, without the path of the temporary file.
fn reason(error: StoreError) -> String {
    match error {
        StoreError::File { reason, .. } => reason,
        other => other.to_string(),
    }
}
