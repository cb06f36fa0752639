//! The layouts of PLOT3D files: as a caller states them, and as they are tried.

use std::fmt;

use crate::ByteOrder;

/// The layout of PLOT3D files, of the grid and of its solution, as far as the caller knows it. A `None` is found from the
/// file's length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Plot3dLayout {
    /// Of binary files.
    pub order: Option<ByteOrder>,
    /// Of binary files.
    pub precision: Option<Precision>,
    /// Whether each Fortran record has its length, 32 bits, before and after it.
    pub has_record_marks: Option<bool>,
    /// Whether the number of grids comes first.
    pub is_multi_grid: Option<bool>,
    /// 2 or 3: plane grids have neither k nor z.
    pub n_axes: Option<u32>,
    /// Whether an integer for each node follows the coordinates, 0 for a hole.
    pub has_iblank: Option<bool>,
}

/// The numbers of a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Precision {
    F32,
    F64,
}

impl Precision {
    pub(super) const fn n_bytes(self) -> usize {
        match self {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }
}

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Binary(Binary),
    Text,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) order: ByteOrder,
    pub(super) precision: Precision,
    pub(super) has_record_marks: bool,
}

/// The numbers after the sizes of the grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    Grid { has_iblank: bool },
    Solution,
    Functions,
}

impl Content {
    pub(super) fn name(self) -> &'static str {
        match self {
            Content::Grid { .. } => "a grid",
            Content::Solution => "a solution",
            Content::Functions => "functions",
        }
    }
}

/// One layout of a whole file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) encoding: Encoding,
    pub(super) is_multi_grid: bool,
    pub(super) n_axes: u32,
    pub(super) content: Content,
}

impl Layout {
    /// Whether the caller's statements allow it.
    pub(super) fn agrees(&self, stated: &Plot3dLayout) -> bool {
        fn allows<T: PartialEq>(stated: Option<T>, value: T) -> bool {
            stated.is_none_or(|stated| stated == value)
        }
        let encoding = match self.encoding {
            Encoding::Text => true,
            Encoding::Binary(binary) => {
                allows(stated.order, binary.order)
                    && allows(stated.precision, binary.precision)
                    && allows(stated.has_record_marks, binary.has_record_marks)
            }
        };
        let iblank = match self.content {
            Content::Grid { has_iblank } => allows(stated.has_iblank, has_iblank),
            _ => true,
        };
        encoding && iblank && allows(stated.is_multi_grid, self.is_multi_grid) && allows(stated.n_axes, self.n_axes)
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.encoding {
            Encoding::Text => f.write_str("text")?,
            Encoding::Binary(Binary { order, precision, has_record_marks }) => {
                let order = if order == ByteOrder::Big { "big" } else { "little" };
                let precision = if precision == Precision::F32 { "f32" } else { "f64" };
                let marks = if has_record_marks { " in records" } else { "" };
                write!(f, "{order}-endian {precision}{marks}")?;
            }
        }
        let count = if self.is_multi_grid { "multi" } else { "single" };
        write!(f, ", {count} {}-D", self.n_axes)?;
        match self.content {
            Content::Grid { has_iblank: true } => f.write_str(" with IBLANK"),
            _ => Ok(()),
        }
    }
}
