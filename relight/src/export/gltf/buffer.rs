//! The binary half of a glTF: vertex attributes and indices, and the accessors that name them.

use serde_json::{Value, json};
use support::slice;

/// What is kept in one view of the buffer: all data of one kind, so that views stay few.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Three 32-bit floats: positions, normals.
    Vec3,
    /// Two 32-bit floats: texture coordinates.
    Vec2,
    /// Four 16-bit fractions: colours.
    Color,
    /// 16-bit indices.
    Short,
    /// 32-bit indices.
    Long,
    /// One 32-bit float: times.
    Float,
    /// Two 32-bit floats that are no vertices: values of animations.
    Pair,
    /// Floats of colours that are no vertices.
    Triple,
    /// Four floats of colours that are no vertices.
    Quad,
}

impl Kind {
    const ALL: [Kind; 9] = [
        Kind::Vec3,
        Kind::Vec2,
        Kind::Color,
        Kind::Short,
        Kind::Long,
        Kind::Float,
        Kind::Pair,
        Kind::Triple,
        Kind::Quad,
    ];

    /// Bytes per element; `None` for what is no vertex.
    fn stride(self) -> Option<usize> {
        match self {
            Kind::Vec3 => Some(12),
            Kind::Vec2 | Kind::Color => Some(8),
            _ => None,
        }
    }

    fn target(self) -> Option<u32> {
        match self {
            Kind::Vec3 | Kind::Vec2 | Kind::Color => Some(34962),
            Kind::Short | Kind::Long => Some(34963),
            _ => None,
        }
    }

    /// Component type and shape.
    fn shape(self) -> (u32, &'static str) {
        match self {
            Kind::Vec3 | Kind::Triple => (5126, "VEC3"),
            Kind::Vec2 | Kind::Pair => (5126, "VEC2"),
            Kind::Color => (5123, "VEC4"),
            Kind::Quad => (5126, "VEC4"),
            Kind::Short => (5123, "SCALAR"),
            Kind::Long => (5125, "SCALAR"),
            Kind::Float => (5126, "SCALAR"),
        }
    }
}

/// Data being gathered.
#[derive(Debug, Default)]
pub struct Buffers {
    data: [Vec<u8>; 9],
    /// Kind of each accessor's view; the number of the view is known at the end.
    accessors: Vec<(Kind, Value)>,
}

impl Buffers {
    /// Appends elements and returns the number of their accessor.
    pub fn add(&mut self, kind: Kind, bytes: &[u8], count: usize) -> usize {
        let Some(data) = slice::get_mut(&mut self.data, kind as usize) else {
            return 0;
        };
        data.resize(data.len().next_multiple_of(4), 0);
        let (component, shape) = kind.shape();
        let mut accessor = json!({
            "byteOffset": data.len(),
            "componentType": component,
            "count": count,
            "type": shape,
        });
        if kind == Kind::Color
            && let Value::Object(map) = &mut accessor
        {
            map.insert("normalized".into(), json!(true));
        }
        data.extend_from_slice(bytes);
        self.accessors.push((kind, accessor));
        self.accessors.len() - 1
    }

    /// Appends vectors of floats, as [`add`](Self::add).
    pub fn add_floats<const N: usize>(
        &mut self,
        kind: Kind,
        values: impl Iterator<Item = [f32; N]>,
    ) -> usize {
        let mut bytes = Vec::new();
        let mut count = 0;
        for value in values {
            bytes.extend(value.into_iter().flat_map(f32::to_le_bytes));
            count += 1;
        }
        self.add(kind, &bytes, count)
    }

    /// States the least and the largest values of an accessor.
    pub fn bound(&mut self, accessor: usize, least: &[f32], largest: &[f32]) {
        if let Some((_, Value::Object(map))) = self.accessors.get_mut(accessor) {
            map.insert("min".into(), json!(least));
            map.insert("max".into(), json!(largest));
        }
    }

    /// The buffer, its views, and the accessors.
    pub fn finish(self) -> (Vec<u8>, Vec<Value>, Vec<Value>) {
        let mut bytes = Vec::with_capacity(self.data.iter().map(|d| d.len() + 4).sum());
        let mut views = Vec::new();
        let mut numbers = [0; 9];
        for ((kind, data), number) in Kind::ALL.into_iter().zip(&self.data).zip(&mut numbers) {
            if data.is_empty() {
                continue;
            }
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            let mut view = json!({
                "buffer": 0,
                "byteOffset": bytes.len(),
                "byteLength": data.len(),
            });
            if let Value::Object(map) = &mut view {
                if let Some(stride) = kind.stride() {
                    map.insert("byteStride".into(), json!(stride));
                }
                if let Some(target) = kind.target() {
                    map.insert("target".into(), json!(target));
                }
            }
            *number = views.len();
            views.push(view);
            bytes.extend_from_slice(data);
        }
        let accessors = self
            .accessors
            .into_iter()
            .map(|(kind, mut accessor)| {
                if let Value::Object(map) = &mut accessor {
                    let number = numbers.get(kind as usize).copied().unwrap_or(0);
                    map.insert("bufferView".into(), json!(number));
                }
                accessor
            })
            .collect();
        (bytes, views, accessors)
    }
}
