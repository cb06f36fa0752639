//! The triangles of a mesh, as shaders read them.

use brickfield_core::Aabb;
use brickfield_core::glam::DVec3;
use bytemuck::{Pod, Zeroable};

use crate::Chunked;
use crate::content::Pages;

/// Vertices with values, and triangles between them. It does not change, and backends know it by its identity.
#[derive(Clone, Debug)]
pub struct Mesh {
    center: DVec3,
    radius: f64,
    unit: f64,
    vertices: Vec<MeshVertex>,
    triangles: Vec<MeshTriangle>,
    has_normals: bool,
    vertex_table: Pages,
    triangle_table: Pages,
}

/// A vertex as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MeshVertex {
    /// Relative to the mesh's centre, in units of [`Mesh::unit`].
    pub position: [f32; 3],
    /// The data value.
    pub value: f32,
    /// The surface's normal, of length 1; 0 if triangles' own normals are to be used.
    pub normal: [f32; 3],
    /// Nothing: shaders read four numbers at a time.
    pub padding: f32,
}

/// A triangle as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct MeshTriangle {
    /// Numbers of vertices.
    pub corners: [u32; 3],
    /// Bit i: the edge from corner i to the next one is a line of the mesh.
    pub edges: u32,
}

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MeshError {
    #[error("{n} {what} for {n_vertices} vertices")]
    Count { what: &'static str, n: usize, n_vertices: usize },
    #[error("vertex {vertex} has the {what} {value}; it must be finite")]
    NotFinite { what: &'static str, vertex: usize, value: DVec3 },
    #[error("triangle {triangle} has the corner {corner}, but there are {n_vertices} vertices")]
    Corner { triangle: usize, corner: u32, n_vertices: usize },
    #[error("a mesh that reaches {radius} from its centre; at most {} is possible", Mesh::MAX_RADIUS)]
    Far { radius: f64 },
    #[error("a mesh of {n} {what}; at most {} are possible", Mesh::MAX)]
    TooMany { what: &'static str, n: usize },
}

/// Bytes of vertices or triangles that are brought together.
const PAGE_BYTES: usize = 1 << 18;
/// Smaller meshes are drawn in this unit, about.
const LEAST_UNIT: f64 = 1e-30;

impl Mesh {
    /// The most vertices, and the most triangles.
    pub const MAX: usize = 1 << 28;

    /// The greatest distance of a vertex from the centre, in world units.
    pub const MAX_RADIUS: f64 = 1e30;

    /// The mesh of positions in the world, values, and triangles. Without `normals` triangles are lit as planes.
    ///
    /// # Errors
    /// Not one value (and normal) for each position; numbers that are not finite; triangles without corners; too many, or too far apart.
    pub fn new(
        positions: &[DVec3],
        values: &[f32],
        normals: Option<&[DVec3]>,
        triangles: Vec<MeshTriangle>,
    ) -> Result<Mesh, MeshError> {
        check(positions, values, normals, &triangles)?;
        let extent = match positions {
            [] => Aabb { min: DVec3::ZERO, max: DVec3::ZERO },
            some => Aabb::of_points(some.iter().copied()),
        };
        let (center, radius) = (extent.center(), 0.5 * extent.diagonal());
        if radius.is_nan() || radius > Mesh::MAX_RADIUS {
            return Err(MeshError::Far { radius });
        }
        let unit = if radius > 0.0 { 2f64.powi(radius.max(LEAST_UNIT).log2().ceil() as i32) } else { 1.0 };
        let vertex = |i: usize| MeshVertex {
            position: ((positions[i] - center) / unit).as_vec3().to_array(),
            value: values[i],
            normal: normals.map_or([0.0; 3], |n| n[i].as_vec3().to_array()),
            padding: 0.0,
        };
        let vertices: Vec<MeshVertex> = (0..positions.len()).map(vertex).collect();
        Ok(Mesh {
            center,
            radius,
            unit,
            has_normals: normals.is_some(),
            vertex_table: Pages::of(bytemuck::cast_slice(&vertices), PAGE_BYTES),
            triangle_table: Pages::of(bytemuck::cast_slice(&triangles), PAGE_BYTES),
            vertices,
            triangles,
        })
    }

    /// The middle of the box around all vertices.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// No vertex is farther from the centre.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// A power of two near the radius, in world units: with lengths in this unit, products of them stay within f32.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// The vertices.
    pub fn vertices(&self) -> &[MeshVertex] {
        &self.vertices
    }

    /// The triangles.
    pub fn triangles(&self) -> &[MeshTriangle] {
        &self.triangles
    }

    /// Whether vertices have normals.
    pub fn has_normals(&self) -> bool {
        self.has_normals
    }

    /// The position of a vertex relative to the centre, as it is drawn, in world units.
    #[inline]
    pub fn position(&self, vertex: u32) -> DVec3 {
        let [x, y, z] = self.vertices[vertex as usize].position;
        DVec3::new(x.into(), y.into(), z.into()) * self.unit
    }

    /// The vertices as a device holds them.
    pub fn vertex_table(&self) -> &dyn Chunked {
        &self.vertex_table
    }

    /// The triangles as a device holds them.
    pub fn triangle_table(&self) -> &dyn Chunked {
        &self.triangle_table
    }
}

fn check(
    positions: &[DVec3],
    values: &[f32],
    normals: Option<&[DVec3]>,
    triangles: &[MeshTriangle],
) -> Result<(), MeshError> {
    let n_vertices = positions.len();
    for (what, n) in [("vertices", n_vertices), ("triangles", triangles.len())] {
        if n > Mesh::MAX {
            return Err(MeshError::TooMany { what, n });
        }
    }
    for (what, n) in [("values", values.len()), ("normals", normals.map_or(n_vertices, <[DVec3]>::len))] {
        if n != n_vertices {
            return Err(MeshError::Count { what, n, n_vertices });
        }
    }
    let not_finite = |what, vertex: usize, value: DVec3| Err(MeshError::NotFinite { what, vertex, value });
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        return not_finite("position", i, positions[i]);
    }
    if let Some(i) = values.iter().position(|v| !v.is_finite()) {
        return not_finite("value", i, DVec3::splat(values[i].into()));
    }
    if let Some((i, n)) = normals.and_then(|normals| normals.iter().enumerate().find(|(_, n)| !n.as_vec3().is_finite()))
    {
        return not_finite("normal", i, *n);
    }
    let beyond = |t: &MeshTriangle| t.corners.into_iter().find(|corner| *corner as usize >= n_vertices);
    match triangles.iter().enumerate().find_map(|(i, t)| Some((i, beyond(t)?))) {
        Some((triangle, corner)) => Err(MeshError::Corner { triangle, corner, n_vertices }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 4.0, 2.0)];

    fn triangle(corners: [u32; 3]) -> Vec<MeshTriangle> {
        vec![MeshTriangle { corners, edges: 7 }]
    }

    #[test]
    fn vertices_lie_around_their_centre() {
        let far = CORNERS.map(|p| p + 1e9);
        let mesh = Mesh::new(&far, &[1.0; 3], None, triangle([0, 1, 2])).unwrap();
        assert_eq!(mesh.center(), DVec3::new(0.5, 2.0, 1.0) + 1e9);
        assert_eq!(mesh.position(2), DVec3::new(-0.5, 2.0, 1.0));
        assert!((mesh.radius() - 0.5 * 21f64.sqrt()).abs() < 1e-12);
        assert_eq!(mesh.vertex_table().n_bytes(), 96);
        let nothing = Mesh::new(&[], &[], None, Vec::new()).unwrap();
        assert_eq!((nothing.radius(), nothing.center()), (0.0, DVec3::ZERO));
    }

    #[test]
    fn faults_are_named() {
        let error = |values: &[f32], normals: Option<&[DVec3]>, corners| {
            Mesh::new(&CORNERS, values, normals, triangle(corners)).unwrap_err().to_string()
        };
        assert_eq!(error(&[0.0; 2], None, [0, 1, 2]), "2 values for 3 vertices");
        assert_eq!(error(&[0.0; 3], Some(&[DVec3::X]), [0, 1, 2]), "1 normals for 3 vertices");
        assert!(error(&[0.0, f32::NAN, 0.0], None, [0, 1, 2]).starts_with("vertex 1 has the value"));
        let far = Mesh::new(&CORNERS.map(|p| p * 1e39), &[0.0; 3], None, Vec::new()).unwrap_err();
        assert!(far.to_string().starts_with("a mesh that reaches"));
        assert_eq!(error(&[0.0; 3], None, [0, 1, 3]), "triangle 0 has the corner 3, but there are 3 vertices");
    }
}
