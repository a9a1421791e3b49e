//! The scene: what a user wrote, as plain data, and everything that can be wrong with it. Touches no file.

mod body;
mod effect;
mod errors;
mod flow;
mod locate;
mod material;
mod model;
mod output;
mod parse;
mod paths;
mod rules;
mod schema;
mod structure;

pub use body::*;
pub use effect::*;
pub use errors::{Kind, Problem, SceneError, SceneErrors};
pub use flow::*;
pub use material::*;
pub use model::*;
pub use output::*;
pub use parse::parse;
pub use paths::{OutsideRoot, check_paths, inside_root};
pub use schema::schema;
