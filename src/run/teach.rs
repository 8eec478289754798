//! Asking the teachers: what each view's colors are to be, and how much each
//! pixel of that counts.

use std::{
    collections::BTreeSet,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    RunError,
    answers::{is_gray, is_plain, mean, scaled, with_hints, with_strokes},
};
use crate::{
    capture::{Capture, Dataset, FRAMES, photo_folder, photos_in},
    chroma::{
        Colorizer, ColorizerError, Supervision, ViewTarget, teach,
        teacher::{
            AbImage, GrayImage, HintFolder, HintImage, Query, Teacher, TeacherError,
            TeacherSettings,
        },
    },
    hash::Hasher,
    report::{Report, TeacherReport},
    tell::{Event, Observer, Stage},
};

/// Teachers, their settings and hints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TeachOptions {
    /// Teachers and their weights, above 0; may be empty where there are hints.
    pub teachers: Vec<(PathBuf, f32)>,
    /// A program that colors the photos, see [`TeacherCommand`](super::TeacherCommand), and its
    /// weight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<(String, f32)>,
    pub settings: TeacherSettings,
    /// Factor of their a and b, 0 to 1.
    pub strength: f32,
    /// A folder of painted hints.
    pub hints: Option<PathBuf>,
    /// True if a stroke also colors the surface under it in all views; otherwise it counts only
    /// where it is painted.
    pub grow_hints: bool,
}

impl Default for TeachOptions {
    fn default() -> Self {
        Self {
            teachers: Vec::new(),
            command: None,
            settings: TeacherSettings::default(),
            strength: 1.0,
            hints: None,
            grow_hints: true,
        }
    }
}

impl TeachOptions {
    /// The teachers of a run that is colored, as far as they can be asked again.
    pub(crate) fn of_run(report: &Report) -> Self {
        let chroma = report.chroma.as_ref();
        let teachers = chroma.into_iter().flat_map(|chroma| &chroma.teachers);
        Self {
            teachers: teachers
                .filter_map(|teacher| Some((teacher.path.as_ref()?.into(), teacher.weight)))
                .collect(),
            settings: chroma.map_or_else(TeacherSettings::default, |chroma| TeacherSettings {
                profile: chroma.teacher_profile.clone(),
                size: chroma.teacher_size,
                class: chroma.teacher_class,
                upsample: chroma.upsample,
                ..TeacherSettings::default()
            }),
            strength: chroma.map_or(1.0, |chroma| chroma.strength),
            ..Self::default()
        }
    }
}

/// The teacher that stands for the photos themselves.
const PHOTOS: &str = "photos";

/// The file, folder or name that `teacher` stands for: `photos` are those of the capture,
/// whatever lies here under that name, as the photos that it was prepared from often do;
/// `photos/` is a folder.
pub fn teacher_or_photos(teacher: &Path, colmap_dir: &Path) -> PathBuf {
    if teacher.as_os_str() == PHOTOS {
        photo_folder(colmap_dir)
    } else {
        teacher.to_owned()
    }
}

/// The teachers and hints of a command, opened.
pub(crate) struct Teachers {
    teachers: Vec<Member>,
    /// True if the options include settings for networks.
    asked_of_networks: bool,
    strength: f32,
    hints: Option<(PathBuf, HintFolder)>,
    grow_hints: bool,
}

struct Member {
    path: PathBuf,
    teacher: Teacher,
    weight: f32,
    /// True if the teacher is a folder with images for some photos only: hand-made work, of which
    /// none is held out.
    partial: bool,
}

/// Combined supervision from teachers and hints.
pub(crate) struct TeacherAnswers {
    pub supervision: Supervision,
    /// Views that have hints.
    pub hinted: usize,
    /// SHA-256 of the supervision.
    pub wanted: String,
}

/// Teachers while they are asked about the views of a dataset, in order.
struct TeacherQueries<'a, 'o> {
    teachers: &'a mut Teachers,
    dataset: &'a Dataset,
    observe: &'a mut Observer<'o>,
    /// The view that comes next.
    view: usize,
    /// For how many views that colors are learned from each teacher has an answer, and how many of
    /// these are gray, or a network's of one color.
    answered: Vec<[usize; 2]>,
    /// True if any view has a hint.
    hints_cover: bool,
    /// Views that have hints.
    hinted: usize,
    /// Hash of the supervision.
    wanted: Hasher,
}

impl Colorizer for TeacherQueries<'_, '_> {
    fn colorize(
        &mut self,
        query: Query<'_>,
        gray: GrayImage<'_>,
    ) -> Result<Option<ViewTarget>, ColorizerError> {
        let (view, capture) = (self.view, &self.dataset.capture);
        self.view += 1;
        (self.observe)(Event::progress(
            Stage::Teacher,
            view,
            capture.views.len(),
            query.name,
        ));
        let trained = self.dataset.split.train.contains(&view);
        let folder = self.teachers.hints.as_ref();
        let folder = folder.map(|(_, folder)| folder.load(query, gray));
        let mut hints = folder.transpose()?.flatten();
        self.hints_cover |= hints.is_some();
        if hints.as_ref().is_some_and(HintImage::is_empty) {
            (self.observe)(Event::Warning(format!(
                "left out the hints for {}: nothing is painted there",
                query.name
            )));
            hints = None;
        }
        let mut answers = Vec::new();
        let mut by_hand = hints.is_some();
        let members = self.teachers.teachers.iter_mut();
        for (member, [answered, in_gray]) in members.zip(&mut self.answered) {
            if let Some(answer) = member.teacher.colorize(query, gray, hints.as_ref())? {
                let learned = trained || member.partial;
                *answered += usize::from(learned);
                let dull = match member.teacher.is_network() {
                    true => is_plain(&answer),
                    false => is_gray(&answer),
                };
                *in_gray += usize::from(learned && dull);
                by_hand |= member.partial;
                answers.push((answer, member.weight));
            }
        }
        let strength = self.teachers.strength;
        let answer = mean(answers).map(|answer| scaled(answer, strength));
        self.hinted += usize::from(hints.is_some());
        let hints = hints.map(|hints| hints.resized(gray.width, gray.height));
        let wanted = match hints {
            Some(hints) if self.teachers.grow_hints => Some(with_strokes(answer, hints)),
            Some(hints) => Some(with_hints(answer, &hints)),
            None => answer.map(ViewTarget::from),
        };
        let wanted = wanted.map(|wanted| ViewTarget { by_hand, ..wanted });
        self.wanted.update(query.name.as_bytes());
        if let Some(wanted) = &wanted {
            self.wanted.update(bytemuck::cast_slice(&wanted.ab.ab));
            let weights = wanted.weights.as_deref().unwrap_or_default();
            self.wanted.update(bytemuck::cast_slice(weights));
            let strokes = wanted.strokes.as_ref().map(|strokes| &strokes.paint[..]);
            self.wanted
                .update(bytemuck::cast_slice(strokes.unwrap_or_default()));
            self.wanted.update(&[u8::from(wanted.by_hand)]);
        }
        Ok(wanted)
    }
}

impl Teachers {
    /// Opens them for the photos of a COLMAP folder; networks keep their answers in `cache`.
    pub fn open(
        options: &TeachOptions,
        colmap_dir: &Path,
        cache: Option<&Path>,
    ) -> Result<Self, RunError> {
        let member = |(path, weight): &(PathBuf, f32)| {
            let path = teacher_or_photos(path, colmap_dir);
            Ok(Member {
                teacher: Teacher::open(&path, cache, &options.settings)?,
                weight: *weight,
                partial: false,
                path,
            })
        };
        let hints = options.hints.as_ref();
        let hints = hints.map(|path| Ok::<_, RunError>((path.clone(), HintFolder::open(path)?)));
        Ok(Self {
            teachers: options
                .teachers
                .iter()
                .map(member)
                .collect::<Result<_, RunError>>()?,
            asked_of_networks: options.settings.profile.is_some()
                || options.settings.size.is_some()
                || options.settings.class.is_some(),
            strength: options.strength,
            hints: hints.transpose()?,
            grow_hints: options.grow_hints,
        })
    }

    /// Adds a folder of images.
    pub fn add(
        &mut self,
        folder: PathBuf,
        weight: f32,
        options: &TeachOptions,
    ) -> Result<(), RunError> {
        self.teachers.push(Member {
            teacher: Teacher::open(&folder, None, &options.settings)?,
            weight,
            partial: false,
            path: folder,
        });
        Ok(())
    }

    /// Returns true if settings for networks were given, but no teacher is one.
    fn asks_no_network(&self) -> bool {
        let networks = self
            .teachers
            .iter()
            .any(|member| member.teacher.is_network());
        self.asked_of_networks && !networks
    }

    /// Name, kind and weight of each teacher.
    pub fn describe(&self) -> Vec<TeacherReport> {
        let describe = |member: &Member| {
            let found = member.path.canonicalize();
            let path = found.as_ref().unwrap_or(&member.path);
            TeacherReport {
                info: member.teacher.describe(),
                path: path.to_str().map(str::to_owned),
                weight: member.weight,
            }
        };
        self.teachers.iter().map(describe).collect()
    }

    /// Says which photos there are, so that a folder's image of one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        for member in &mut self.teachers {
            member.teacher.know(capture);
        }
    }

    /// Weighted mean of the teachers' answers for one photo, at its size; `None` if there is none.
    pub fn color(
        &mut self,
        query: Query<'_>,
        gray: GrayImage<'_>,
    ) -> Result<Option<AbImage>, RunError> {
        let mut answers = Vec::new();
        for member in &mut self.teachers {
            if let Some(answer) = member.teacher.colorize(query, gray, None)? {
                answers.push((answer, member.weight));
            }
        }
        let strength = self.strength;
        Ok(mean(answers).map(|answer| scaled(answer, strength)))
    }

    /// Asks about every view, and keeps what is wanted at so many scales.
    ///
    /// # Errors
    /// [`RunError::Teacher`], [`RunError::NotPlaced`] or [`RunError::TeacherCoversNothing`] where
    /// a teacher or the hints have no image for any view that counts, and
    /// [`RunError::NothingPainted`] where there are but hints, all of them empty.
    pub fn ask(
        &mut self,
        dataset: &Dataset,
        scales: usize,
        observe: &mut Observer<'_>,
    ) -> Result<TeacherAnswers, RunError> {
        if self.asks_no_network() {
            observe(Event::Warning(
                "profile and size change nothing: no teacher is a network".into(),
            ));
        }
        for member in &mut self.teachers {
            let told = member.teacher.passed_over().into_iter();
            told.for_each(|line| observe(Event::Warning(line)));
            member.teacher.know(&dataset.capture);
            member.partial = is_partial(&member.teacher, dataset)?;
        }
        if let Some((_, hints)) = &mut self.hints {
            hints.know(&dataset.capture);
        }
        let mut asking = TeacherQueries {
            answered: vec![[0; 2]; self.teachers.len()],
            hints_cover: false,
            hinted: 0,
            wanted: Hasher::default(),
            view: 0,
            dataset,
            observe,
            teachers: self,
        };
        let told = &mut |_| ControlFlow::Continue(());
        let supervision = teach(dataset, &mut asking, scales, told)?;
        let (answered, hinted, wanted) = (asking.answered, asking.hinted, asking.wanted.finish());
        let mut covers: Vec<bool> = answered.iter().map(|[count, _]| *count > 0).collect();
        covers.push(asking.hints_cover);
        self.check(&covers, dataset, &supervision)?;
        for member in &self.teachers {
            member.teacher.check_images()?;
            let doubts = member.teacher.doubts().into_iter();
            doubts.for_each(|line| observe(Event::Warning(line)));
        }
        if let Some((_, hints)) = &self.hints {
            let doubts = hints.doubts().into_iter();
            doubts.for_each(|line| observe(Event::Warning(line)));
        }
        for (member, counts) in self.teachers.iter().zip(answered) {
            if let Some(warning) = gray_images(member, counts, dataset)? {
                observe(Event::Warning(warning));
            }
        }
        for member in &mut self.teachers {
            if let Some(error) = member.teacher.unkept() {
                observe(Event::Warning(format!(
                    "the network's answers are not cached: {error}"
                )));
            }
        }
        Ok(TeacherAnswers {
            supervision,
            hinted,
            wanted,
        })
    }

    /// Checks that every source covers a view that counts; `covers` has a flag for each teacher and
    /// then for the hints.
    fn check(
        &self,
        covers: &[bool],
        dataset: &Dataset,
        supervision: &Supervision,
    ) -> Result<(), RunError> {
        if let Some(source) = covers.iter().position(|covers| !covers) {
            let (path, unplaced) = match (self.teachers.get(source), &self.hints) {
                (Some(member), _) => {
                    let covers = |name: &str| member.teacher.covers(Query::from(name));
                    (&member.path, unplaced(dataset, covers)?)
                }
                (None, Some((path, hints))) => {
                    (path, unplaced(dataset, |name| hints.covers(name))?)
                }
                // Without hints there is nothing to cover.
                (None, None) => return Ok(()),
            };
            let example = dataset.capture.views[dataset.split.train[0]].name.clone();
            return Err(match unplaced {
                Some((named, photos)) => RunError::NotPlaced {
                    folder: path.clone(),
                    named,
                    placed: placed(dataset),
                    photos,
                    example,
                },
                None => RunError::TeacherCoversNothing {
                    teacher: path.clone(),
                    example,
                },
            });
        }
        match self.hints.as_ref().map(|(path, _)| path) {
            Some(path) if supervision.colored_views() == 0 => {
                Err(RunError::NothingPainted(path.clone()))
            }
            _ => Ok(()),
        }
    }
}

/// Number of photos with a pose.
fn placed(dataset: &Dataset) -> usize {
    let photos = dataset.capture.views.iter().map(|view| &view.photo);
    photos.collect::<BTreeSet<_>>().len()
}

/// The photos without a pose that a folder has images for, in words, and how many photos there are
/// in all; `None` where it has none for any.
fn unplaced(
    dataset: &Dataset,
    covers: impl Fn(&str) -> Result<bool, TeacherError>,
) -> Result<Option<(String, usize)>, RunError> {
    let capture = &dataset.capture;
    // All frames of a film, which are more than its photos.
    let frames = photos_in(&capture.root.join(FRAMES));
    let all = match frames.is_empty() {
        true => capture.all_photos(),
        false => frames,
    };
    let mut named = Vec::new();
    for name in &all {
        if covers(name)? {
            named.push(name.clone());
        }
    }
    let others = match named.len() {
        0 => return Ok(None),
        1 => String::new(),
        count => format!(" and {} more", count - 1),
    };
    Ok(Some((named.swap_remove(0) + &others, all.len())))
}

/// Returns true if a teacher lacks some of the training photos: then it is a folder of single
/// images, and each counts wherever it lies. A teacher for all photos is measured on the held-out
/// ones.
fn is_partial(teacher: &Teacher, dataset: &Dataset) -> Result<bool, RunError> {
    for &view in &dataset.split.train {
        let query = Query::view(&dataset.capture.views[view], &dataset.cameras[view]);
        if !teacher.covers(query)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A warning about a folder whose images are gray, which would make the scene gray, or about a
/// network that gives each photo a single color. An error if the photos themselves are the
/// teacher and all are gray.
fn gray_images(
    member: &Member,
    [answered, in_gray]: [usize; 2],
    dataset: &Dataset,
) -> Result<Option<String>, RunError> {
    let path = &member.path;
    if member.teacher.is_network() {
        // Single photos may show nothing that has any color.
        return Ok((in_gray > 0 && in_gray == answered).then(|| {
            format!(
                "{} gives each photo one color, gray or another: `gs-chroma teacher check` shows its answers",
                path.display()
            )
        }));
    }
    if in_gray == 0 {
        return Ok(None);
    }
    if in_gray == answered && *path == dataset.capture.photos {
        return Err(RunError::GrayPhotos(path.clone()));
    }
    Ok(Some(format!(
        "{in_gray} of {answered} images in {} are gray: what they show becomes gray; leave them out where nothing is known of their colors",
        path.display()
    )))
}
