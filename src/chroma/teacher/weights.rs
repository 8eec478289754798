//! Files of weights that lie beside a model, as large exports have them.

use super::TeacherError;
use crate::{hash::Hasher, input};
use prost::Message;
use std::collections::BTreeSet;
use std::path::{Component, Path};

/// SHA-256 of a model in hexadecimal: of its `.onnx` file, and where that names files of
/// weights, of these names and files as well, in the order of the names.
///
/// # Errors
/// [`TeacherError::Io`], [`TeacherError::NoWeights`] where a file of weights is not there.
pub(super) fn identity(path: &Path) -> Result<String, TeacherError> {
    let bytes = input::read(path).map_err(TeacherError::io(path))?;
    let mut hasher = Hasher::default();
    hasher.update(&bytes);
    // What does not decode is for ONNX Runtime to complain of.
    let model = Model::decode(&bytes[..]).unwrap_or_default();
    drop(bytes);
    let mut names = BTreeSet::new();
    model.collect(&mut names);
    for name in names {
        let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        let missing = || TeacherError::NoWeights {
            path: path.to_path_buf(),
            weights: name.clone(),
        };
        // The runtime looks nowhere else either.
        if !Path::new(&name).components().all(inside) {
            return Err(missing());
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        hasher.update(format!("\n{name}\n").as_bytes());
        let file = input::open(&folder.join(&name));
        file.and_then(|file| hasher.update_with(file))
            .map_err(|_| missing())?;
    }
    Ok(hasher.finish())
}

/// What of ONNX's messages leads to files of weights; tags are those of `onnx.proto`.
#[derive(Clone, PartialEq, Message)]
struct Model {
    #[prost(message, optional, tag = "7")]
    graph: Option<Graph>,
    #[prost(message, repeated, tag = "25")]
    functions: Vec<Function>,
}

#[derive(Clone, PartialEq, Message)]
struct Graph {
    #[prost(message, repeated, tag = "1")]
    nodes: Vec<Node>,
    #[prost(message, repeated, tag = "5")]
    initializers: Vec<Tensor>,
}

#[derive(Clone, PartialEq, Message)]
struct Function {
    #[prost(message, repeated, tag = "7")]
    nodes: Vec<Node>,
}

#[derive(Clone, PartialEq, Message)]
struct Node {
    #[prost(message, repeated, tag = "5")]
    attributes: Vec<Attribute>,
}

#[derive(Clone, PartialEq, Message)]
struct Attribute {
    #[prost(message, optional, tag = "5")]
    tensor: Option<Tensor>,
    #[prost(message, optional, tag = "6")]
    graph: Option<Graph>,
    #[prost(message, repeated, tag = "10")]
    tensors: Vec<Tensor>,
    #[prost(message, repeated, tag = "11")]
    graphs: Vec<Graph>,
}

#[derive(Clone, PartialEq, Message)]
struct Tensor {
    #[prost(message, repeated, tag = "13")]
    outside: Vec<Entry>,
}

#[derive(Clone, PartialEq, Message)]
struct Entry {
    #[prost(string, tag = "1")]
    key: String,
    #[prost(string, tag = "2")]
    value: String,
}

impl Model {
    fn collect(&self, names: &mut BTreeSet<String>) {
        let of_functions = self.functions.iter().flat_map(|function| &function.nodes);
        self.graph.iter().for_each(|graph| graph.collect(names));
        of_functions.for_each(|node| node.collect(names));
    }
}

impl Graph {
    fn collect(&self, names: &mut BTreeSet<String>) {
        self.nodes.iter().for_each(|node| node.collect(names));
        (self.initializers.iter()).for_each(|tensor| tensor.collect(names));
    }
}

impl Node {
    fn collect(&self, names: &mut BTreeSet<String>) {
        for attribute in &self.attributes {
            let tensors = attribute.tensor.iter().chain(&attribute.tensors);
            tensors.for_each(|tensor| tensor.collect(names));
            let graphs = attribute.graph.iter().chain(&attribute.graphs);
            graphs.for_each(|graph| graph.collect(names));
        }
    }
}

impl Tensor {
    fn collect(&self, names: &mut BTreeSet<String>) {
        let locations = self.outside.iter().filter(|entry| entry.key == "location");
        names.extend(locations.map(|entry| entry.value.clone()));
    }
}
