//! From photos to a model: features, matches, poses, and which piece is taken.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde::Serialize;

use serde_json::json;

use super::{
    CameraMotion, Motion, PrepareError,
    colmap::{self, Colmap, Features},
    database::Matches,
    masks, motion,
    options::{Cameras, DATABASE, Matching, SPARSE},
    panorama,
    photos::Photos,
    state::{OutputState, Step, digest, of},
};
use crate::{
    capture::{Piece, names::by_number},
    disk,
    programs::ProgramError,
    store::files,
    tell::{Event, Observer, Stage, count},
};

/// A share of the photos without a pose that is not worth a word: COLMAP seldom places all.
const USUAL: f64 = 0.1;

/// Names that are told in one line.
const TOLD_NAMES: usize = 6;

/// Poses and points that COLMAP found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Poses {
    /// Photos with a pose.
    pub placed: usize,
    /// Points in the model.
    pub points: usize,
    /// Names of photos without a pose, sorted.
    pub unplaced: Vec<String>,
    /// Photos with a pose in each piece; the first is `sparse/0`.
    ///
    /// COLMAP could not join these.
    pub pieces: Vec<usize>,
}

/// Input of pose estimation.
pub(super) struct Task<'a> {
    pub photos: &'a Photos,
    /// The folder of the photos that COLMAP reads.
    pub seen: &'a Path,
    pub masks: Option<PathBuf>,
    pub cameras: Cameras,
    pub lens: &'a str,
    pub matching: Matching,
    /// The camera's motion, where it was told.
    pub motion: Option<CameraMotion>,
    pub is_film: bool,
}

impl Task<'_> {
    /// Makes `database.db` and `sparse/`.
    ///
    /// # Errors
    /// [`PrepareError`].
    pub fn find(
        &self,
        state: &mut OutputState,
        colmap: &Colmap,
        observe: &mut Observer<'_>,
    ) -> Result<(Option<Motion>, Poses), PrepareError> {
        let masks = self.masks.as_deref().map_or(Ok(String::new()), digest)?;
        let features = of(&[
            "features",
            &digest(self.seen)?,
            &masks,
            &json!(self.cameras).to_string(),
            self.lens,
            &colmap.name(),
        ]);
        let by_number = match self.by_number() {
            Some(_) => " by number",
            None => "",
        };
        let matching = format!("{}{by_number}", json!(self.matching));
        let matches = of(&["matches", &features, &matching]);
        let poses = match self.motion {
            Some(motion) => of(&["poses", &matches, &motion.to_string()]),
            None => of(&["poses", &matches]),
        };
        let done = [
            state.is_done(Step::Features, &features),
            state.is_done(Step::Matches, &matches),
            state.is_done(Step::Poses, &poses),
        ];
        if done != [true; 3] {
            state.check_own(SPARSE)?;
        }
        // What was matched otherwise cannot be unmatched.
        if !(done[0] && (done[1] || !state.was_done(Step::Matches))) {
            self.look_for_features(state, colmap, &features, observe)?;
        }
        if !state.is_done(Step::Matches, &matches) {
            self.match_photos(state, colmap, &matches, observe)?;
        }
        let seen = match Matches::read(&state.path(DATABASE)) {
            Err(error) if self.motion.is_none() => {
                observe(Event::Warning(format!(
                    "{error}; poses are looked for as of a camera that moves"
                )));
                Matches::default()
            }
            read => read?,
        };
        let found = motion::found(&seen, self.motion);
        if let Some((motion, _)) = &found {
            observe(Event::Note(motion.in_words()));
        }
        let still = found
            .as_ref()
            .filter(|(motion, _)| motion.camera != CameraMotion::Moves);
        match still {
            _ if state.is_done(Step::Poses, &poses) => {}
            Some((_, still)) => {
                let draft = state.draft()?;
                let sparse = draft.path().join(SPARSE);
                let model = sparse.join("0");
                for folder in [&sparse, &model] {
                    disk::make_folder(folder).map_err(files::at(folder))?;
                }
                panorama::write(still, &seen, &model)?;
                state.place(Step::Poses, &poses, &[(sparse, SPARSE)])?;
            }
            None => self.place(state, colmap, &poses, observe)?,
        }
        let poses = self.judge(state, observe)?;
        Ok((found.map(|(motion, _)| motion), poses))
    }

    /// Names in the order of their numbers, where photos are matched one after the other and
    /// COLMAP, which sorts plainly, would take another.
    fn by_number(&self) -> Option<Vec<&str>> {
        let mut names: Vec<&str> = self.photos.headers.keys().map(String::as_str).collect();
        names.sort_by(|a, b| by_number(a, b));
        let other = self.matching == Matching::Sequential && !names.is_sorted();
        other.then_some(names)
    }

    fn look_for_features(
        &self,
        state: &mut OutputState,
        colmap: &Colmap,
        from: &str,
        observe: &mut Observer<'_>,
    ) -> Result<(), PrepareError> {
        state.check_own(DATABASE)?;
        let draft = state.draft()?;
        let database = draft.path().join(DATABASE);
        let all_masks = draft.path().join("masks");
        if let Some(masks) = &self.masks {
            masks::complete(self.photos, masks, &all_masks)?;
        }
        let features = Features {
            images: self.seen,
            masks: self.masks.is_some().then_some(all_masks.as_path()),
            cameras: self.cameras,
            lens: self.lens,
        };
        let photos = self.photos.headers.len();
        count(observe, Stage::Features, 0, photos);
        colmap.features(&database, &features, &mut |done, total| {
            count(observe, Stage::Features, done, total.unwrap_or(photos));
        })?;
        // What COLMAP makes is checked where it is used; that it made nothing, here.
        if !database.is_file() {
            return Err(PrepareError::Program(ProgramError::Failed {
                program: colmap.name(),
                said: "wrote no database".to_owned(),
            }));
        }
        state.forget(Step::Matches);
        state.place(Step::Features, from, &[(database, DATABASE)])
    }

    fn match_photos(
        &self,
        state: &mut OutputState,
        colmap: &Colmap,
        from: &str,
        observe: &mut Observer<'_>,
    ) -> Result<(), PrepareError> {
        state.check_own(DATABASE)?;
        let draft = state.draft()?;
        let database = draft.path().join(DATABASE);
        disk::copy(&state.path(DATABASE), &database).map_err(files::at(&database))?;
        let photos = self.photos.headers.len();
        let path = draft.path().join("pairs.txt");
        let names = self.by_number();
        let list = names.as_deref().and_then(colmap::pairs);
        if let Some(list) = &list {
            files::write(&path, list.as_bytes())?;
        } else if names.is_some() {
            observe(Event::Warning(
                "photos are matched by name, IMG 10 before IMG 2: rename them without spaces or with leading zeros, or choose exhaustive matching".to_owned(),
            ));
        }
        let pairs = list.is_some().then_some(&*path);
        count(observe, Stage::Matches, 0, photos);
        colmap.matches(&database, (self.matching, pairs), &mut |done, total| {
            count(observe, Stage::Matches, done, total.unwrap_or(photos));
        })?;
        state.place(Step::Matches, from, &[(database, DATABASE)])
    }

    fn place(
        &self,
        state: &mut OutputState,
        colmap: &Colmap,
        from: &str,
        observe: &mut Observer<'_>,
    ) -> Result<(), PrepareError> {
        let draft = state.draft()?;
        let (found, sparse) = (draft.path().join("found"), draft.path().join(SPARSE));
        for folder in [&found, &sparse] {
            disk::make_folder(folder).map_err(files::at(folder))?;
        }
        // The mapper may write into the database that it reads.
        let database = draft.path().join(DATABASE);
        disk::copy(&state.path(DATABASE), &database).map_err(files::at(&database))?;
        let photos = self.photos.headers.len();
        let mut placed = 0;
        count(observe, Stage::Poses, 0, photos);
        let ended = colmap.poses(&database, self.seen, &found, &mut |done, total| {
            placed = placed.max(done);
            count(observe, Stage::Poses, placed, total.unwrap_or(photos));
        });
        let mut pieces = Vec::new();
        for model in colmap::models(&found) {
            if let Some(piece) = Piece::read(&model)? {
                pieces.push((piece, model));
            }
        }
        // Some versions end with an error where they place nothing.
        if pieces.is_empty() {
            return Err(match ended {
                Err(error) if !has_no_pair(&error) => error,
                _ => PrepareError::NoPoses {
                    remedy: self.remedies(),
                },
            });
        }
        ended?;
        // Of several with as many the first.
        pieces.sort_by_key(|(piece, _)| std::cmp::Reverse(piece.photos.len()));
        for (place, (_, model)) in pieces.iter().enumerate() {
            let to = sparse.join(place.to_string());
            disk::rename(model, &to).map_err(files::at(&to))?;
        }
        state.place(Step::Poses, from, &[(sparse, SPARSE)])
    }

    /// Counts what was placed, and says what to try where that is little.
    fn judge(
        &self,
        state: &OutputState,
        observe: &mut Observer<'_>,
    ) -> Result<Poses, PrepareError> {
        let mut pieces = Vec::new();
        for model in colmap::models(&state.path(SPARSE)) {
            pieces.extend(Piece::read(&model)?);
        }
        let Some((taken, others)) = pieces.split_first() else {
            return Err(PrepareError::NoPoses {
                remedy: self.remedies(),
            });
        };
        let placed: BTreeSet<&String> = taken.photos.iter().collect();
        let elsewhere: BTreeSet<&String> = others.iter().flat_map(|piece| &piece.photos).collect();
        let unplaced: Vec<&String> = (self.photos.headers.keys())
            .filter(|name| !placed.contains(name))
            .collect();
        if let [first, ..] = others {
            observe(Event::Note(format!(
                "COLMAP found {} pieces that it could not join: using the one of {} photos, sparse/0; the next has {}",
                pieces.len(),
                taken.photos.len(),
                first.photos.len()
            )));
        }
        if unplaced.len() as f64 > USUAL * self.photos.headers.len() as f64 {
            let alone = unplaced.iter().filter(|name| !elsewhere.contains(**name));
            let alone = alone.count();
            let apart = match unplaced.len() - alone {
                0 => String::new(),
                apart => format!("{apart} are in other pieces, "),
            };
            let names = unplaced.iter().take(TOLD_NAMES);
            let names: Vec<&str> = names.map(|name| name.as_str()).collect();
            let more = if unplaced.len() > TOLD_NAMES {
                ", …"
            } else {
                ""
            };
            observe(Event::Warning(format!(
                "{} of {} photos have no pose ({}{more}): {apart}{alone} have too few matches with any; {}",
                unplaced.len(),
                self.photos.headers.len(),
                names.join(", "),
                self.remedies()
            )));
        }
        Ok(Poses {
            placed: taken.photos.len(),
            points: taken.points,
            unplaced: unplaced.into_iter().cloned().collect(),
            pieces: pieces.iter().map(|piece| piece.photos.len()).collect(),
        })
    }

    /// Remedies to suggest when photos have no pose.
    fn remedies(&self) -> String {
        let exhaustive = match self.matching {
            Matching::Sequential => ", exhaustive matching",
            Matching::Exhaustive => "",
        };
        match self.is_film {
            true => format!(
                "the camera moved too little or too fast for these frames; try more of them a second{exhaustive}, or another shot"
            ),
            false => format!(
                "photos have to overlap by two thirds and to be taken from different places; try more of them{exhaustive}"
            ),
        }
    }
}

/// Returns true if COLMAP failed because no photos overlap enough.
fn has_no_pair(error: &PrepareError) -> bool {
    let PrepareError::Program(ProgramError::Failed { said, .. }) = error else {
        return false;
    };
    [
        "sparse model",
        "initial pair",
        "initial image pair",
        "No images with matches",
    ]
    .iter()
    .any(|words| said.contains(words))
}
