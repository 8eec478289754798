//! A program of the user's as a teacher: it is given gray pictures and writes colored ones, which
//! are then a folder of images like any other.

use std::path::{Path, PathBuf, absolute};

use image::{GrayImage, ImageFormat, ImageReader};

use super::RunError;
use crate::{
    capture::{CaptureError, Dataset, Original, View, first_views, in_order},
    chroma::teacher::ASPECT_TOLERANCE,
    disk,
    hash::Hasher,
    input,
    programs::Program,
    store::{StoreError, files},
    tell::{Event, Observer, Stage},
};

/// Words that stand for a gray picture and its colored one, and for folders of all.
const ONE: [&str; 2] = ["{in}", "{out}"];
const ALL: [&str; 2] = ["{in_dir}", "{out_dir}"];

/// A program with its arguments.
pub struct TeacherCommand {
    words: Vec<String>,
    /// [`ONE`] or [`ALL`].
    names: [&'static str; 2],
}

/// A photo that is to be colored: the name of its image, width and height.
type Picture = (String, [u32; 2]);

impl TeacherCommand {
    /// Splits words as a shell does, which is not asked itself: nothing but quotes and backslashes
    /// has a meaning.
    ///
    /// # Errors
    /// In words, if a quote is not closed, or pictures are not named.
    pub fn parse(text: &str) -> Result<Self, String> {
        let words = shlex::split(text).ok_or("a quote is not closed")?;
        let has = |name: &str| words.iter().skip(1).any(|word| word.contains(name));
        let names = match [ONE, ALL].map(|names| names.map(has)) {
            [[true, true], [false, false]] => ONE,
            [[false, false], [true, true]] => ALL,
            _ => {
                return Err(
                    "needs a program with {in} and {out}, or {in_dir} and {out_dir}".into(),
                );
            }
        };
        Ok(Self { words, names })
    }

    /// Has photos colored that are not yet in a folder below `place`, and returns it. Its name
    /// tells command, files that this names, and photos.
    ///
    /// # Errors
    /// If a photo cannot be read, the program does not start, fails or writes no such picture.
    pub(super) fn color(
        &self,
        dataset: &Dataset,
        place: &Path,
        observe: &mut Observer<'_>,
    ) -> Result<PathBuf, RunError> {
        files::make_folder(place)?;
        let draft = disk::create_folder("command-", place).map_err(files::at(place))?;
        let [from, to] = ["in", "out"].map(|name| draft.path().join(name));
        let (mut pictures, key) = self.pictures(dataset, &from)?;
        let folder = place.join(format!("command-{}", &key[..16]));
        let whole = self.names == ALL;
        let missing = |(name, _): &Picture| !folder.join(name).is_file();
        match whole {
            true if !pictures.iter().any(missing) => pictures.clear(),
            true => {}
            false => pictures.retain(missing),
        }
        let total = pictures.len();
        for (done, picture) in pictures.iter().enumerate() {
            let (name, _) = picture;
            let [gray, colored] = [from.join(name), to.join(name)];
            files::make_folder_of(&colored)?;
            if whole {
                continue;
            }
            observe(Event::progress(Stage::Teacher, done, total, name));
            self.start([&gray, &colored], &mut |_| {})?;
            self.check(&colored, picture)?;
            let kept = folder.join(name);
            files::make_folder_of(&kept)?;
            disk::rename(&colored, &kept).map_err(files::at(&kept))?;
        }
        if whole && total > 0 {
            self.start([&from, &to], &mut |line| {
                observe(Event::progress(Stage::Teacher, 0, total, line));
            })?;
            for picture in &pictures {
                self.check(&to.join(&picture.0), picture)?;
            }
            disk::remove(&folder).map_err(files::at(&folder))?;
            disk::rename(&to, &folder).map_err(files::at(&folder))?;
        }
        Ok(folder)
    }

    /// Runs the program to its end in the current folder.
    fn start(&self, paths: [&Path; 2], heard: &mut dyn FnMut(&str)) -> Result<(), RunError> {
        let paths = paths.map(|path| absolute(path).unwrap_or_else(|_| path.into()));
        // Put into words that are split already: a path is part of one, whatever is in it.
        let filled = self.words[1..].iter().map(|word| {
            let pairs = self.names.iter().zip(&paths);
            pairs.fold(word.clone(), |word, (name, path)| {
                word.replace(name, &path.to_string_lossy())
            })
        });
        let program = Program::new(&self.words[0]).args(filled);
        Ok(program.run(Path::new("."), heard)?)
    }

    /// Checks that the program has written a picture of a photo.
    fn check(&self, path: &Path, (name, photo): &Picture) -> Result<(), RunError> {
        let size = match path.is_file() {
            true => ImageReader::open(path)
                .and_then(ImageReader::with_guessed_format)
                .map_err(|error| error.to_string())
                .and_then(|reader| reader.into_dimensions().map_err(|error| error.to_string())),
            false => Err(format!("no picture at {} of this name", self.names[1])),
        };
        let aspect = |[width, height]: [u32; 2]| f64::from(width) / f64::from(height);
        let fits = |size| (aspect(size) / aspect(*photo) - 1.0).abs() <= ASPECT_TOLERANCE;
        let reason = match size {
            Ok((width, height)) if fits([width, height]) => return Ok(()),
            Ok((width, height)) => {
                let [w, h] = photo;
                format!("{width}×{height} pixels, of another aspect than {w}×{h}")
            }
            Err(reason) => reason,
        };
        let (program, picture) = (self.words[0].clone(), name.clone());
        Err(RunError::NoPicture {
            program,
            picture,
            reason,
        })
    }

    /// Writes all photos with a pose into a folder: gray, upright, as PNG of 8 bits, no larger than
    /// training takes them. Gives them with the SHA-256 of what determines their colors.
    fn pictures(
        &self,
        dataset: &Dataset,
        folder: &Path,
    ) -> Result<(Vec<Picture>, String), RunError> {
        let mut hasher = Hasher::default();
        for word in &self.words {
            hasher.update(format!("{word}\n").as_bytes());
            // What cannot be read is as good as not there.
            let _ = input::open(Path::new(word)).and_then(|file| hasher.update_with(file));
        }
        let views: Vec<&View> = first_views(&dataset.capture.views).collect();
        let (loader, range) = (dataset.loader(), dataset.options.normalize);
        let mut pictures = Vec::with_capacity(views.len());
        in_order(
            &views,
            |view| loader.original(view, range),
            |view, original: Result<Original, CaptureError>| {
                let (image, size) = upright(dataset, &original?);
                let mut png = std::io::Cursor::new(Vec::new());
                image
                    .write_to(&mut png, ImageFormat::Png)
                    .map_err(|error| StoreError::file(&view.image_path, error.to_string()))?;
                let name = format!("{}.png", view.photo);
                hasher.update(name.as_bytes());
                hasher.update(png.get_ref());
                let path = folder.join(&name);
                files::make_folder_of(&path)?;
                files::write(&path, png.get_ref())?;
                pictures.push((name, size));
                Ok::<_, RunError>(())
            },
        )?;
        Ok((pictures, hasher.finish()))
    }
}

/// A photo in gray, with its width and height.
fn upright(dataset: &Dataset, original: &Original) -> (GrayImage, [u32; 2]) {
    let size = [original.width, original.height];
    let longer = size[0].max(size[1]);
    let most = dataset.options.max_side.unwrap_or(longer).min(longer);
    let scale = f64::from(most) / f64::from(longer);
    let size = size.map(|side| ((f64::from(side) * scale).round() as u32).max(1));
    let upright = original.stance.upright;
    // Of a folder's image only its sides tell that it stands.
    let upright = Some(upright)
        .filter(|way| way.size(size) != size)
        .unwrap_or_default();
    let gray = upright.turned(original.shrunk(size), 1, size);
    let size = upright.size(size);
    // Pixels fill their size.
    let image = GrayImage::from_raw(size[0], size[1], gray).unwrap_or_default();
    (image, size)
}
