//! The program as its users meet it: arguments in, files, text and exit code out.
//!
//! A Vulkan, Metal or DirectX 12 adapter and ONNX Runtime are needed
//! (`tools/setup.py` installs both); a software adapter will do.

use gs_chroma::low_level::oracle;

mod against;
mod auto;
mod blocks;
mod checkup;
mod coordinates;
mod doctor;
mod documented;
mod elsewhere;
mod ends;
mod errors;
mod eval;
mod eval_photos;
mod faults;
// The host is trusted by OpenSSL's variable, which other systems do not ask.
#[cfg(target_os = "linux")]
mod fetch;
mod folder;
mod formats;
mod frames;
mod frames_film;
#[cfg(target_os = "linux")]
mod hard_cases;
mod harm;
mod host;
mod hostile;
mod inspect;
#[path = "../device/stability/literals.rs"]
mod literals;
mod masks;
mod names;
mod package;
mod pages;
mod paint;
mod paths;
mod photos;
mod picture;
// Programs of others are stood in for by shell scripts.
#[cfg(unix)]
mod prepare;
mod program;
mod repeat;
mod resume;
mod scene;
mod shared;
mod solver;
mod soundness;
mod splat_file;
mod strokes;
mod studio;
mod teach;
mod teach_together;
#[cfg(unix)]
mod teacher_command;
#[cfg(target_os = "linux")]
mod terminal;
mod tradeoff;
mod train;
mod transforms;
mod turned;
mod variants;
mod view;
mod view_page;
mod viewers;
