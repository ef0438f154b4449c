//! Numbers in buffers: elements read one at a time, whatever their type, however they lie.

use super::document::Document;
use ::gltf::json::accessor::{Accessor, ComponentType, IndexComponentType, Type};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3};

/// Sparse values of a file that are looked at, at most: accessors may share them.
const MOST_SPARSE: u64 = 1 << 27;

/// What an accessor is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Use {
    /// Positions.
    Position,
    /// Normals.
    Normal,
    /// Texture coordinates.
    TexCoord,
    /// Vertex colours.
    Colour,
    /// Indices of vertices.
    Index,
}

impl Use {
    /// How messages call it.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Position => "POSITION",
            Self::Normal => "NORMAL",
            Self::TexCoord => "TEXCOORD",
            Self::Colour => "COLOR_0",
            Self::Index => "indices",
        }
    }

    /// Whether elements may be of this type, `KHR_mesh_quantization` included.
    fn allows(self, type_: Type, component: ComponentType) -> bool {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        match self {
            Self::Position => type_ == Type::Vec3 && component != U32,
            Self::Normal => type_ == Type::Vec3 && matches!(component, F32 | I8 | I16),
            Self::TexCoord => type_ == Type::Vec2 && component != U32,
            Self::Colour => matches!(type_, Type::Vec3 | Type::Vec4) && matches!(component, F32 | U8 | U16),
            Self::Index => type_ == Type::Scalar && matches!(component, U8 | U16 | U32),
        }
    }
}

/// An accessor whose elements can be read: all of them lie in their buffers.
#[derive(Debug)]
pub(super) struct Reader {
    /// How many elements there are.
    pub count: u64,
    /// Bytes of an element.
    size: usize,
    component: ComponentType,
    normalized: bool,
    /// Zeros without.
    dense: Option<Dense>,
    sparse: Option<Sparse>,
}

#[derive(Debug)]
struct Dense {
    buffer: usize,
    start: usize,
    stride: usize,
}

#[derive(Debug)]
struct Sparse {
    count: usize,
    index: ComponentType,
    indices: Dense,
    values: Dense,
}

impl Reader {
    /// The accessor of that number, or what is wrong with it; `sparse` counts what is looked at.
    pub(super) fn new(document: &Document, number: usize, purpose: Use, sparse: &mut u64) -> Result<Self, String> {
        let accessor = document.root.accessors.get(number).ok_or("it does not exist")?;
        let (Checked::Valid(type_), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return Err("its type is none of glTF".into());
        };
        let component = component.0;
        if !purpose.allows(type_, component) {
            return Err(format!("{type_:?} of {component:?} is no type for it"));
        }
        let size = type_.multiplicity() * component.size();
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let dense = match accessor.buffer_view.is_none() {
            true => None,
            false => Some(Dense::new(document, accessor.buffer_view, offset, accessor.count.0, size)?),
        };
        let sparse = Sparse::new(document, accessor, size, sparse)?;
        Ok(Self { count: accessor.count.0, size, component, normalized: accessor.normalized, dense, sparse })
    }

    /// Bytes of an element; `None` for zeros, as beyond the end.
    fn element<'d>(&self, document: &'d Document, at: u32) -> Option<&'d [u8]> {
        let sparse = self
            .sparse
            .as_ref()
            .and_then(|sparse| Some(sparse.values.at(document, sparse.find(document, at)?, self.size)));
        sparse.unwrap_or_else(|| self.dense.as_ref()?.at(document, at as usize, self.size))
    }

    /// The first components of an element; 0 where it has none.
    fn components<const N: usize>(&self, document: &Document, at: u32) -> [f32; N] {
        let mut out = [0.0; N];
        if let Some(bytes) = self.element(document, at) {
            let each = bytes.chunks_exact(self.component.size());
            out.iter_mut().zip(each).for_each(|(out, bytes)| *out = number(bytes, self.component, self.normalized));
        }
        out
    }

    /// Three components.
    pub(super) fn vec3(&self, document: &Document, at: u32) -> Vec3 {
        Vec3::from(self.components::<3>(document, at))
    }

    /// Two components.
    pub(super) fn vec2(&self, document: &Document, at: u32) -> Vec2 {
        Vec2::from(self.components::<2>(document, at))
    }

    /// A colour, whose whole numbers are always shares of the largest.
    pub(super) fn colour(&self, document: &Document, at: u32) -> Vec3 {
        let colour = self.vec3(document, at);
        match self.component {
            ComponentType::U8 if !self.normalized => colour / 255.0,
            ComponentType::U16 if !self.normalized => colour / 65535.0,
            _ => colour,
        }
    }

    /// An index.
    pub(super) fn index(&self, document: &Document, at: u32) -> u32 {
        self.element(document, at).map_or(0, |bytes| whole(bytes, self.component))
    }
}

impl Dense {
    /// `count` elements of `size` bytes from `offset` in a view, if that holds them.
    fn new(
        document: &Document,
        view: Option<::gltf::json::Index<::gltf::json::buffer::View>>,
        offset: u64,
        count: u64,
        size: usize,
    ) -> Result<Self, String> {
        let view = view.ok_or("it has no buffer view")?;
        let (buffer, range) = document.view(view)?;
        let stride = document.root.buffer_views[view.value()].byte_stride.map_or(size, |stride| stride.0.max(1));
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride as u64)?.checked_add(offset)?.checked_add(size as u64));
        if end.is_none_or(|end| end > range.len() as u64) {
            let (length, number) = (range.len(), view.value());
            return Err(format!(
                "{count} elements of {size} bytes, {stride} apart, from {offset} on go beyond buffer view {number} of {length}"
            ));
        }
        Ok(Self { buffer, start: range.start + offset as usize, stride })
    }

    fn at<'d>(&self, document: &'d Document, at: usize, size: usize) -> Option<&'d [u8]> {
        let start = self.start.checked_add(at.checked_mul(self.stride)?)?;
        document.buffer(self.buffer).get(start..start.checked_add(size)?)
    }
}

impl Sparse {
    fn new(document: &Document, accessor: &Accessor, size: usize, looked_at: &mut u64) -> Result<Option<Self>, String> {
        let Some(sparse) = &accessor.sparse else { return Ok(None) };
        let Checked::Valid(IndexComponentType(index)) = sparse.indices.component_type else {
            return Err("the type of its sparse indices is none of glTF".into());
        };
        let count = sparse.count.0;
        if count > accessor.count.0 {
            return Err(format!("it has {count} sparse values for {} elements", accessor.count.0));
        }
        let indices =
            Dense::new(document, Some(sparse.indices.buffer_view), sparse.indices.byte_offset.0, count, index.size())?;
        let values = Dense::new(document, Some(sparse.values.buffer_view), sparse.values.byte_offset.0, count, size)?;
        *looked_at = looked_at.saturating_add(count);
        if *looked_at > MOST_SPARSE {
            return Err(format!("the file has more than {MOST_SPARSE} sparse values: export it without"));
        }
        let sparse = Self { count: count as usize, index, indices, values };
        let mut least = 0;
        for at in 0..sparse.count {
            let found = u64::from(sparse.index_at(document, at));
            if found < least || found >= accessor.count.0 {
                return Err(format!(
                    "its sparse index {found} does not ascend, or is beyond its {} elements",
                    accessor.count.0
                ));
            }
            least = found + 1;
        }
        Ok(Some(sparse))
    }

    fn index_at(&self, document: &Document, at: usize) -> u32 {
        self.indices.at(document, at, self.index.size()).map_or(0, |bytes| whole(bytes, self.index))
    }

    /// Which of its values is that of an element.
    fn find(&self, document: &Document, element: u32) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.index_at(document, middle) < element { low = middle + 1 } else { high = middle }
        }
        (low < self.count && self.index_at(document, low) == element).then_some(low)
    }
}

/// An unsigned number.
fn whole(bytes: &[u8], component: ComponentType) -> u32 {
    match (component, bytes) {
        (ComponentType::U8, &[a, ..]) => a.into(),
        (ComponentType::U16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        (_, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

/// A component as a number; normalised ones are shares of the largest.
fn number(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let (value, largest) = match (component, bytes) {
        (ComponentType::I8, &[a, ..]) => (f32::from(a.cast_signed()), 127.0),
        (ComponentType::U8, &[a, ..]) => (f32::from(a), 255.0),
        (ComponentType::I16, &[a, b, ..]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (ComponentType::U16, &[a, b, ..]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (ComponentType::U32, &[a, b, c, d, ..]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
        (_, &[a, b, c, d, ..]) => return f32::from_le_bytes([a, b, c, d]),
        _ => return 0.0,
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_numbers_or_shares() {
        let share = |bytes: &[u8], component| number(bytes, component, true);
        assert_eq!([share(&[127], ComponentType::I8), share(&[128], ComponentType::I8)], [1.0, -1.0]);
        assert_eq!(share(&[255], ComponentType::U8), 1.0);
        assert_eq!(share(&[1, 128], ComponentType::I16), -1.0);
        assert_eq!(share(&[255, 255], ComponentType::U16), 1.0);
        assert_eq!(number(&[0, 1], ComponentType::I16, false), 256.0);
        assert_eq!(number(&2.5_f32.to_le_bytes(), ComponentType::F32, false), 2.5);
    }
}
