//! FFmpeg's and ffprobe's input options: a film is one file that leads to no other, or numbered
//! pictures of one folder.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use super::{Program, ProgramError};

/// FFmpeg's names of what films come in. Lists of other files, such as HLS, DASH, concat and IMF,
/// scripts, numbered pictures and devices are not among them.
const FORMATS: &str = "mov,matroska,avi,mpegts,mpeg,mpegvideo,h264,hevc,vvc,m4v,av1,obu,ivf,\
    vc1,vc1test,h261,h263,cavsvideo,avs2,avs3,dirac,dnxhd,mjpeg,mjpeg_2000,smjpeg,yuv4mpegpipe,dv,\
    mxf,gxf,lxf,asf,asf_o,wtv,flv,ogg,nut,nuv,nsv,rm,gif,apng,webp,cine,r3d,swf,flic,bink,smk";

/// Numbered pictures of a folder that are the frames of a film.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pictures {
    /// The folder, absolute.
    pub folder: PathBuf,
    /// Their names, as C writes them.
    pub names: String,
    /// Number of the first.
    pub first: u64,
    /// Frames a second: numerator and denominator.
    pub rate: [u32; 2],
}

/// Streams and format of a film in the words of `ffprobe`, which are JSON.
pub(crate) fn probe(film: &Path) -> Result<String, ProgramError> {
    streams().film(film).ask()
}

/// The same of numbered pictures.
pub(crate) fn probe_pictures(pictures: &Pictures) -> Result<String, ProgramError> {
    streams().pictures(pictures).ask()
}

fn streams() -> Program {
    Program::new("ffprobe")
        .args(["-v", "error", "-of", "json"])
        .args(["-show_streams", "-show_format"])
}

impl Program {
    /// Adds numbered pictures as the input of FFmpeg or ffprobe; its options stand before.
    pub fn pictures(self, pictures: &Pictures) -> Self {
        let Pictures {
            folder,
            names,
            first,
            rate,
        } = pictures;
        // A folder's name may hold a %, too.
        let folder = folder.to_string_lossy().replace('%', "%%");
        self.option("-protocol_whitelist", "file")
            .args(["-f", "image2", "-pattern_type", "sequence"])
            .option("-framerate", format!("{}/{}", rate[0], rate[1]))
            .option("-start_number", first.to_string())
            .option("-i", format!("file:{folder}/{names}"))
    }

    /// Adds a film as the input of FFmpeg or ffprobe; its options stand before.
    pub fn film(self, path: &Path) -> Self {
        // Taken for nothing else: no option, no protocol.
        let mut name = OsString::from("file:");
        name.push(path);
        self.option("-protocol_whitelist", "file")
            .option("-format_whitelist", FORMATS)
            .option("-i", name)
    }
}
