//! Stage 2: colour, distilled from a teacher into frozen geometry.

pub mod teacher;
