//! Memory layouts of the structs that shaders share with the host, read from their SPIR-V.
//!
//! `build.rs` includes this file and turns what it finds into constants, so that a host struct can be checked against
//! the shaders at compile time. The format is that of the SPIR-V specification 1.6, §2.3 and §3.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;

/// A member of a struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Name in the shader.
    pub name: String,
    /// Bytes from the start of the struct.
    pub offset: u32,
    /// Bytes that it takes; 0 for an array without a length.
    pub size: u32,
}

/// A struct in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Name in the shader.
    pub name: String,
    /// Members in their order.
    pub members: Vec<Member>,
    /// Bytes from one element to the next where the struct is an element of an array.
    pub stride: Option<u32>,
    /// End of the last member, rounded up to the largest scalar: what `size_of` gives for the like `repr(C)` struct.
    pub packed_size: u32,
}

impl Layout {
    /// Bytes that one struct takes: its stride, or its packed size where no array shows the stride.
    pub fn size(&self) -> u32 {
        self.stride.unwrap_or(self.packed_size)
    }

    /// Whether both describe the same memory; a missing stride agrees with any.
    pub fn agrees_with(&self, other: &Self) -> bool {
        let strides = self.stride.zip(other.stride);
        self.name == other.name && self.members == other.members && strides.is_none_or(|(a, b)| a == b)
    }
}

/// `name { member at offset (size), … } size`, for messages.
impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let members: Vec<String> =
            self.members.iter().map(|m| format!("{} at {} ({} bytes)", m.name, m.offset, m.size)).collect();
        write!(f, "{} {{ {} }} of {} bytes", self.name, members.join(", "), self.size())
    }
}

/// The layouts of every struct reachable from a uniform, storage or push-constant block or through a buffer reference.
///
/// The error says what is wrong with the module.
pub fn read(words: &[u32]) -> Result<Vec<Layout>, String> {
    let module = Module::parse(words)?;
    let mut found = BTreeMap::new();
    let mut strides = HashMap::new();
    let mut seen = HashSet::new();
    let mut pending = module.block_roots();
    while let Some(id) = pending.pop() {
        if !seen.insert(id) {
            continue;
        }
        match module.types.get(&id) {
            Some(Type::Struct(members)) => {
                pending.extend(members);
                if let Some(layout) = module.layout(id, members)? {
                    found.insert(id, layout);
                }
            }
            Some(Type::Array { element, .. }) => {
                pending.push(*element);
                if let Some(&stride) = module.array_strides.get(&id) {
                    strides.insert(*element, stride);
                }
            }
            Some(Type::Pointer { class, pointee }) if is_block_class(*class) => pending.push(*pointee),
            _ => {}
        }
    }
    Ok(found.into_iter().map(|(id, layout)| Layout { stride: strides.get(&id).copied(), ..layout }).collect())
}

/// A name in snake case: `SlotChunk`, `slotChunk` and `slot_chunk` give `slot_chunk`.
pub fn snake_case(name: &str) -> String {
    let characters: Vec<char> = name.chars().collect();
    let mut snake = String::new();
    for (i, &c) in characters.iter().enumerate() {
        let after_lower = i > 0 && (characters[i - 1].is_lowercase() || characters[i - 1].is_ascii_digit());
        let ends_acronym =
            i > 0 && characters[i - 1].is_uppercase() && characters.get(i + 1).is_some_and(|next| next.is_lowercase());
        if c.is_uppercase() && (after_lower || ends_acronym) {
            snake.push('_');
        }
        snake.extend(if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '_' }.to_lowercase());
    }
    snake
}

/// The storage classes whose memory the host fills: Uniform, PushConstant, StorageBuffer, PhysicalStorageBuffer.
const BLOCK_CLASSES: [u32; 4] = [2, 9, 12, PHYSICAL_STORAGE_BUFFER];
const PHYSICAL_STORAGE_BUFFER: u32 = 5349;

fn is_block_class(class: u32) -> bool {
    BLOCK_CLASSES.contains(&class)
}

/// A type, as far as its size in memory goes.
enum Type {
    Scalar {
        bytes: u32,
    },
    Vector {
        component: u32,
        count: u32,
    },
    Matrix {
        column: u32,
        columns: u32,
    },
    /// `length` is the id of a constant; `None` where it is known at run time only.
    Array {
        element: u32,
        length: Option<u32>,
    },
    Struct(Vec<u32>),
    Pointer {
        class: u32,
        pointee: u32,
    },
}

/// Decorations of one member that place it.
#[derive(Default)]
struct Placement {
    name: String,
    offset: Option<u32>,
    matrix_stride: u32,
    row_major: bool,
}

/// What the layouts need of a SPIR-V module.
#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    members: HashMap<(u32, u32), Placement>,
    array_strides: HashMap<u32, u32>,
    constants: HashMap<u32, u32>,
    types: HashMap<u32, Type>,
}

impl Module {
    fn parse(words: &[u32]) -> Result<Self, String> {
        const MAGIC: u32 = 0x0723_0203;
        const HEADER_WORDS: usize = 5;
        if words.first() != Some(&MAGIC) || words.len() < HEADER_WORDS {
            return Err("not a SPIR-V module".to_owned());
        }
        let mut module = Self::default();
        let mut rest = &words[HEADER_WORDS..];
        while let Some(&first) = rest.first() {
            let length = (first >> 16) as usize;
            if length == 0 || length > rest.len() {
                return Err("a SPIR-V instruction is cut short".to_owned());
            }
            module.instruction(first & 0xffff, &rest[1..length]);
            rest = &rest[length..];
        }
        Ok(module)
    }

    /// Notes one instruction; the patterns name the opcodes of SPIR-V §3.52.
    fn instruction(&mut self, opcode: u32, operands: &[u32]) {
        const NAME: u32 = 5;
        const MEMBER_NAME: u32 = 6;
        const CONSTANT: u32 = 43;
        const DECORATE: u32 = 71;
        const MEMBER_DECORATE: u32 = 72;
        const ARRAY_STRIDE: u32 = 6;
        match (opcode, operands) {
            (NAME, [id, text @ ..]) => {
                self.names.insert(*id, string(text));
            }
            (MEMBER_NAME, [id, member, text @ ..]) => {
                self.members.entry((*id, *member)).or_default().name = string(text);
            }
            (DECORATE, [id, ARRAY_STRIDE, stride]) => {
                self.array_strides.insert(*id, *stride);
            }
            (MEMBER_DECORATE, [id, member, decoration @ ..]) => {
                self.members.entry((*id, *member)).or_default().decorate(decoration);
            }
            (CONSTANT, [_, id, value, ..]) => {
                self.constants.insert(*id, *value);
            }
            (_, [id, rest @ ..]) => {
                if let Some(kind) = Type::of(opcode, rest) {
                    self.types.insert(*id, kind);
                }
            }
            _ => {}
        }
    }

    /// What pointers into host-filled memory point at.
    fn block_roots(&self) -> Vec<u32> {
        let pointee = |kind: &Type| match kind {
            Type::Pointer { class, pointee } if is_block_class(*class) => Some(*pointee),
            _ => None,
        };
        self.types.values().filter_map(pointee).collect()
    }

    /// The layout of a struct, without its stride; `None` where its members have no place in memory.
    fn layout(&self, id: u32, members: &[u32]) -> Result<Option<Layout>, String> {
        let name = self.names.get(&id).cloned().unwrap_or_default();
        let mut placed = Vec::new();
        for (index, &kind) in (0..).zip(members) {
            let Some(Placement { name: member, offset: Some(offset), .. }) = self.members.get(&(id, index)) else {
                return Ok(None);
            };
            let size = self.member_size(id, index, kind).map_err(|what| format!("struct {name}: {member}: {what}"))?;
            placed.push(Member { name: member.clone(), offset: *offset, size });
        }
        let end = placed.iter().map(|m| m.offset + m.size).max().unwrap_or(0);
        let packed_size = end.next_multiple_of(self.alignment(id).max(1));
        Ok(Some(Layout { name, members: placed, stride: None, packed_size }))
    }

    /// Bytes of a member; matrices take their stride from the member's decorations.
    fn member_size(&self, owner: u32, index: u32, kind: u32) -> Result<u32, String> {
        match (self.types.get(&kind), self.members.get(&(owner, index))) {
            (Some(Type::Matrix { column, columns }), Some(place)) if place.matrix_stride > 0 => {
                let Some(Type::Vector { component, count }) = self.types.get(column) else {
                    return Err("a matrix without columns".to_owned());
                };
                let (vectors, components) = if place.row_major { (*count, *columns) } else { (*columns, *count) };
                Ok((vectors - 1) * place.matrix_stride + components * self.size(*component)?)
            }
            _ => self.size(kind),
        }
    }

    /// Bytes of a type that is not a matrix; 0 for an array without a length.
    fn size(&self, kind: u32) -> Result<u32, String> {
        match self.types.get(&kind) {
            Some(Type::Scalar { bytes }) => Ok(*bytes),
            Some(Type::Vector { component, count }) => Ok(self.size(*component)? * count),
            Some(Type::Array { length: None, .. }) => Ok(0),
            Some(Type::Array { length: Some(length), .. }) => {
                let count = self.constants.get(length).ok_or("the length of an array must be a plain constant")?;
                let stride = self.array_strides.get(&kind).ok_or("an array without a stride")?;
                Ok(count * stride)
            }
            Some(Type::Struct(members)) => {
                let layout = self.layout(kind, members)?.ok_or("a struct whose members have no offsets")?;
                Ok(layout.packed_size)
            }
            Some(Type::Pointer { class: PHYSICAL_STORAGE_BUFFER, .. }) => Ok(8),
            _ => Err("a type that memory cannot hold".to_owned()),
        }
    }

    /// The largest scalar in a type, bytes; a buffer reference counts as the 8 bytes of its address.
    fn alignment(&self, kind: u32) -> u32 {
        match self.types.get(&kind) {
            Some(Type::Scalar { bytes }) => *bytes,
            Some(Type::Vector { component: inner, .. } | Type::Matrix { column: inner, .. }) => self.alignment(*inner),
            Some(Type::Array { element, .. }) => self.alignment(*element),
            Some(Type::Struct(members)) => members.iter().map(|&m| self.alignment(m)).max().unwrap_or(1),
            Some(Type::Pointer { .. }) => 8,
            None => 1,
        }
    }
}

impl Placement {
    /// Notes a decoration of SPIR-V §3.20.
    fn decorate(&mut self, decoration: &[u32]) {
        const ROW_MAJOR: u32 = 4;
        const MATRIX_STRIDE: u32 = 7;
        const OFFSET: u32 = 35;
        match decoration {
            [ROW_MAJOR] => self.row_major = true,
            [MATRIX_STRIDE, stride] => self.matrix_stride = *stride,
            [OFFSET, offset] => self.offset = Some(*offset),
            _ => {}
        }
    }
}

impl Type {
    /// The type that an `OpType…` instruction declares; `operands` without the result id.
    fn of(opcode: u32, operands: &[u32]) -> Option<Self> {
        const INT: u32 = 21;
        const FLOAT: u32 = 22;
        const VECTOR: u32 = 23;
        const MATRIX: u32 = 24;
        const ARRAY: u32 = 28;
        const RUNTIME_ARRAY: u32 = 29;
        const STRUCT: u32 = 30;
        const POINTER: u32 = 32;
        Some(match (opcode, operands) {
            (INT | FLOAT, [bits, ..]) => Self::Scalar { bytes: bits / 8 },
            (VECTOR, [component, count]) => Self::Vector { component: *component, count: *count },
            (MATRIX, [column, columns]) => Self::Matrix { column: *column, columns: *columns },
            (ARRAY, [element, length]) => Self::Array { element: *element, length: Some(*length) },
            (RUNTIME_ARRAY, [element]) => Self::Array { element: *element, length: None },
            (STRUCT, members) => Self::Struct(members.to_vec()),
            (POINTER, [class, pointee]) => Self::Pointer { class: *class, pointee: *pointee },
            _ => return None,
        })
    }
}

/// A literal string: UTF-8, little-endian in its words, ended by a zero byte.
fn string(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|&b| b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A module under construction, as an assembler would write it.
    struct Assembly(Vec<u32>);

    impl Assembly {
        fn new() -> Self {
            Self(vec![0x0723_0203, 0x0001_0600, 0, 100, 0])
        }

        fn op(&mut self, opcode: u32, operands: &[u32]) {
            self.0.push(opcode | (operands.len() as u32 + 1) << 16);
            self.0.extend(operands);
        }

        /// An instruction that ends in a literal string.
        fn text(&mut self, opcode: u32, operands: &[u32], text: &str) {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize((bytes.len() / 4 + 1) * 4, 0);
            let words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            let all: Vec<u32> = operands.iter().copied().chain(words).collect();
            self.op(opcode, &all);
        }

        fn member(&mut self, id: u32, index: u32, name: &str, offset: u32) {
            self.text(6, &[id, index], name);
            self.op(72, &[id, index, 35, offset]);
        }
    }

    const FLOAT: u32 = 1;
    const UINT: u32 = 2;
    const VEC3: u32 = 3;
    const MAT4X3: u32 = 4;
    const SLOT: u32 = 10;
    const CHUNK: u32 = 12;
    const PUSH: u32 = 14;
    const LOCAL: u32 = 20;

    /// What a compiler gives for, in scalar layout,
    /// `struct Slot { vec3 position; float weight; vec3 diffuse; }`,
    /// `buffer_reference SlotChunk { Slot slots[]; }` and
    /// `push_constant Push { SlotChunk chunks[4]; mat4x3 toWorld; uint first; }`,
    /// and for a local variable of another struct.
    fn module() -> Assembly {
        let mut m = Assembly::new();
        m.text(5, &[SLOT], "Slot");
        m.text(5, &[CHUNK], "SlotChunk");
        m.text(5, &[PUSH], "Push");
        m.text(5, &[LOCAL], "Local");
        m.member(SLOT, 0, "position", 0);
        m.member(SLOT, 1, "weight", 12);
        m.member(SLOT, 2, "diffuse", 16);
        m.member(CHUNK, 0, "slots", 0);
        m.member(PUSH, 0, "chunks", 0);
        m.member(PUSH, 1, "toWorld", 32);
        m.op(72, &[PUSH, 1, 7, 12]);
        m.member(PUSH, 2, "first", 80);
        m.op(71, &[11, 6, 28]);
        m.op(71, &[16, 6, 8]);
        m.op(22, &[FLOAT, 32]);
        m.op(21, &[UINT, 32, 0]);
        m.op(23, &[VEC3, FLOAT, 3]);
        m.op(24, &[MAT4X3, VEC3, 4]);
        m.op(39, &[13, 5349]);
        m.op(43, &[UINT, 5, 4]);
        m.op(30, &[SLOT, VEC3, FLOAT, VEC3]);
        m.op(29, &[11, SLOT]);
        m.op(30, &[CHUNK, 11]);
        m.op(32, &[13, 5349, CHUNK]);
        m.op(28, &[16, 13, 5]);
        m.op(30, &[PUSH, 16, MAT4X3, UINT]);
        m.op(32, &[15, 9, PUSH]);
        m.op(30, &[LOCAL, VEC3, UINT]);
        m.op(32, &[21, 7, LOCAL]);
        m
    }

    fn find(layouts: &[Layout], name: &str) -> Layout {
        layouts.iter().find(|l| l.name == name).cloned().unwrap()
    }

    #[test]
    fn structs_behind_push_constants_and_buffer_references_are_found() {
        let layouts = read(&module().0).unwrap();
        let names: Vec<&str> = layouts.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["Slot", "SlotChunk", "Push"], "and nothing that lives in registers");
    }

    #[test]
    fn offsets_and_sizes_are_those_of_the_decorations() {
        let layouts = read(&module().0).unwrap();
        let places = |name: &str| -> Vec<(String, u32, u32)> {
            find(&layouts, name).members.into_iter().map(|m| (m.name, m.offset, m.size)).collect()
        };
        let place = |name: &str, offset, size| (name.to_owned(), offset, size);
        assert_eq!(places("Slot"), [place("position", 0, 12), place("weight", 12, 4), place("diffuse", 16, 12)]);
        assert_eq!(places("SlotChunk"), [place("slots", 0, 0)]);
        assert_eq!(places("Push"), [place("chunks", 0, 32), place("toWorld", 32, 48), place("first", 80, 4)]);
    }

    #[test]
    fn size_is_the_stride_or_ends_on_the_largest_scalar() {
        let layouts = read(&module().0).unwrap();
        assert_eq!(find(&layouts, "Slot").stride, Some(28));
        assert_eq!(find(&layouts, "Slot").size(), 28);
        // 84 bytes of members, rounded up to the 8 of an address.
        assert_eq!(find(&layouts, "Push").stride, None);
        assert_eq!(find(&layouts, "Push").size(), 88);
    }

    #[test]
    fn disagreement_is_a_member_or_a_known_stride() {
        let slot = find(&read(&module().0).unwrap(), "Slot");
        assert!(slot.agrees_with(&Layout { stride: None, ..slot.clone() }));
        assert!(!slot.agrees_with(&Layout { stride: Some(32), ..slot.clone() }));
        let mut moved = slot.clone();
        moved.members[2].offset = 20;
        assert!(!slot.agrees_with(&moved));
    }

    #[test]
    fn broken_modules_are_refused() {
        assert!(read(&[]).is_err());
        assert!(read(&[1, 2, 3, 4, 5]).is_err());
        let mut cut = module().0;
        cut.pop();
        assert!(read(&cut).unwrap_err().contains("cut short"));
        let mut endless = module().0;
        endless.push(30);
        assert!(read(&endless).unwrap_err().contains("cut short"), "a length of zero words never ends");
    }

    #[test]
    fn names_become_snake_case() {
        for (name, snake) in [
            ("Slot", "slot"),
            ("SlotChunk", "slot_chunk"),
            ("materialId", "material_id"),
            ("UVRect", "uv_rect"),
            ("first_slot", "first_slot"),
            ("Level2Data", "level2_data"),
        ] {
            assert_eq!(snake_case(name), snake);
        }
    }
}
