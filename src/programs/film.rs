//! FFmpeg's and ffprobe's input options: a film is one file that leads to no other.

use std::{ffi::OsString, path::Path};

use super::Program;

/// FFmpeg's names of what films come in. Lists of other files, such as HLS, DASH, concat and IMF,
/// scripts, numbered pictures and devices are not among them.
const FORMATS: &str = "mov,matroska,avi,mpegts,mpeg,mpegvideo,h264,hevc,vvc,m4v,av1,obu,ivf,\
    vc1,vc1test,h261,h263,cavsvideo,avs2,avs3,dirac,dnxhd,mjpeg,mjpeg_2000,smjpeg,yuv4mpegpipe,dv,\
    mxf,gxf,lxf,asf,asf_o,wtv,flv,ogg,nut,nuv,nsv,rm,gif,apng,webp,cine,r3d,swf,flic,bink,smk";

impl Program {
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
