//! Lines over pictures: which bricks a frame draws, and where a camera stands.
//!
//! Lines have no depth: the volume hides none of them. A picture with an overlay is for looking, not for measuring.

mod canvas;
mod color_bar;
mod edges;
mod projector;

use brickfield_core::glam::{DVec2, DVec3, UVec2};
use brickfield_core::{BrickId, BrickLayout, Camera, Grid, Image, IndexPos, Level, LinearRgb};
use palette::{LinSrgb, Srgb};

use canvas::{Ink, LinePicture};
pub use color_bar::show_color_bar;
use edges::edges;
use projector::CameraProjector;

/// The colour of a level's bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelColor {
    /// The colour's common name.
    pub name: &'static str,
    /// As sRGB.
    pub srgb: [u8; 3],
}

/// The colours of levels 0 to 6; levels above begin again.
///
/// They are the seven of Okabe and Ito 2008 ("Color Universal Design") that are not black, which colour-blind people tell apart.
pub const LEVEL_COLORS: [LevelColor; 7] = [
    LevelColor { name: "sky blue", srgb: [0x56, 0xb4, 0xe9] },
    LevelColor { name: "orange", srgb: [0xe6, 0x9f, 0x00] },
    LevelColor { name: "bluish green", srgb: [0x00, 0x9e, 0x73] },
    LevelColor { name: "vermilion", srgb: [0xd5, 0x5e, 0x00] },
    LevelColor { name: "reddish purple", srgb: [0xcc, 0x79, 0xa7] },
    LevelColor { name: "yellow", srgb: [0xf0, 0xe4, 0x42] },
    LevelColor { name: "blue", srgb: [0x00, 0x72, 0xb2] },
];

impl LevelColor {
    /// The colour of a level, from [`LEVEL_COLORS`].
    pub const fn of(Level(level): Level) -> LevelColor {
        LEVEL_COLORS[level as usize % LEVEL_COLORS.len()]
    }

    /// As linear light.
    pub fn linear(self) -> LinearRgb {
        let [r, g, b] = self.srgb;
        let linear: LinSrgb<f64> = Srgb::new(r, g, b).into_linear();
        [linear.red, linear.green, linear.blue]
    }
}

/// The opacity of the lines of transparent bricks, relative to the lines of other bricks.
const FAINT: f64 = 0.35;
/// The lines of cameras, and the halo that sets them off from any picture.
const CAMERA_INK: Ink = Ink { color: [0.0; 3], opacity: 1.0, width: 1.25 };
const CAMERA_HALO: Ink = Ink { color: [1.0; 3], opacity: 0.7, width: 3.25 };

/// The picture of `camera`, with the edges of the boxes of `bricks` ([`BrickLayout::index_box`]) over it.
///
/// An edge has the [`LevelColor`] of the coarsest brick that has it, and is drawn once. The finer the level, the thinner and
/// lighter: 0.75 + level / 4 pixels wide (at most 2) and opaque by 0.6 + level / 8 (at most 1) in a picture up to 512 pixels high;
/// in higher ones lines are wider in proportion. Edges behind the eye are not drawn.
///
/// Composited over the picture in linear light; a pixel that no line crosses is the same to the bit.
pub fn show_bricks(
    image: &Image<f32>,
    camera: &Camera,
    grid: &Grid,
    layout: &BrickLayout,
    bricks: &[BrickId],
) -> Image<f32> {
    show(image, camera, grid, layout, bricks, 1.0)
}

/// As [`show_bricks`], about a third as opaque: for bricks that are selected but not drawn, because nothing in them is visible.
pub fn show_bricks_faintly(
    image: &Image<f32>,
    camera: &Camera,
    grid: &Grid,
    layout: &BrickLayout,
    bricks: &[BrickId],
) -> Image<f32> {
    show(image, camera, grid, layout, bricks, FAINT)
}

fn show(
    image: &Image<f32>,
    camera: &Camera,
    grid: &Grid,
    layout: &BrickLayout,
    bricks: &[BrickId],
    share: f64,
) -> Image<f32> {
    let projector = CameraProjector::new(camera, image.size());
    let mut canvas = LinePicture::new(image);
    // The finest first: lines of coarser levels lie over them.
    for of_level in edges(layout, bricks).chunk_by(|a, b| a.level == b.level) {
        let world = |p: DVec3| grid.world(IndexPos(p)).0;
        let lines: Vec<_> = of_level.iter().filter_map(|e| projector.line(e.ends.map(world))).collect();
        let ink = of_level_ink(of_level[0].level);
        canvas.stroke(&lines, &Ink { opacity: share * ink.opacity, ..ink });
    }
    canvas.into_image()
}

fn of_level_ink(level: Level) -> Ink {
    let l = f64::from(level.0);
    Ink { color: LevelColor::of(level).linear(), opacity: (0.6 + l / 8.0).min(1.0), width: (0.75 + l / 4.0).min(2.0) }
}

/// The picture of `camera`, with another camera over it: the pyramid that a picture of `of_size` taken by `of` sees up to the
/// distance `length_world` along its view direction (a box for parallel rays), and a roof over the top edge of its base.
///
/// Black, 1.25 pixels wide, on a white edge; otherwise as [`show_bricks`].
pub fn show_camera(image: &Image<f32>, camera: &Camera, of: &Camera, of_size: UVec2, length_world: f64) -> Image<f32> {
    let projector = CameraProjector::new(camera, image.size());
    let lines: Vec<_> =
        pyramid(of, of_size, length_world).into_iter().filter_map(|ends| projector.line(ends)).collect();
    let mut canvas = LinePicture::new(image);
    canvas.stroke(&lines, &CAMERA_HALO);
    canvas.stroke(&lines, &CAMERA_INK);
    canvas.into_image()
}

/// The edges of a camera's field of view, in the world.
fn pyramid(of: &Camera, size: UVec2, length_world: f64) -> Vec<[DVec3; 2]> {
    let (rays, size) = (of.pixel_rays(size), size.as_dvec2());
    let at = |distance: f64, x: f64, y: f64| {
        let plane = rays.plane(size * DVec2::new(x, y)) * if rays.depth() == 0.0 { 1.0 } else { distance };
        of.eye() + of.forward() * distance + of.right() * plane.x + of.up() * plane.y
    };
    let rectangle = |d: f64| [at(d, 0.0, 0.0), at(d, 1.0, 0.0), at(d, 1.0, 1.0), at(d, 0.0, 1.0)];
    let (near, far) = (rectangle(0.0), rectangle(length_world));
    let around = |r: [DVec3; 4]| (0..4).map(move |i| [r[i], r[(i + 1) % 4]]);
    let sides = (0..4).map(|i| [near[i], far[i]]);
    let roof = at(length_world, 0.5, -0.25);
    let lines = sides.chain(around(near)).chain(around(far)).chain([[far[0], roof], [roof, far[1]]]);
    // The upper end of a pyramid is a point.
    lines.filter(|[a, b]| a != b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;
    use brickfield_core::{BrickSide, Projection};

    const SIZE: UVec2 = UVec2::new(80, 60);

    fn scene() -> (Grid, BrickLayout, Vec<BrickId>) {
        let grid = Grid::axis_aligned(UVec3::new(31, 31, 31), DVec3::ONE).unwrap();
        let layout = BrickLayout::new(grid.dims(), BrickSide::S16);
        (grid, layout, layout.bricks(Level(0)).collect())
    }

    fn look(eye: [f64; 3], target: [f64; 3], projection: Projection) -> Camera {
        Camera::look_at(eye.into(), target.into(), DVec3::Z, projection).unwrap()
    }

    const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.8 };
    const PARALLEL: Projection = Projection::Orthographic { height: 60.0 };

    fn picture() -> Image<f32> {
        let pixel = |i: u32| [i as f32 / 9600.0, 0.1, f32::MIN_POSITIVE, 0.7];
        Image::new(SIZE, (0..SIZE.element_product()).map(pixel).collect()).unwrap()
    }

    fn n_changed(a: &Image<f32>, b: &Image<f32>) -> usize {
        assert_eq!(a.size(), b.size());
        a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count()
    }

    #[test]
    fn nothing_to_draw_changes_nothing() {
        let (grid, layout, bricks) = scene();
        let image = picture();
        for projection in [PERSPECTIVE, PARALLEL] {
            let camera = look([100.0, 12.0, 15.5], [15.0; 3], projection);
            assert_eq!(show_bricks(&image, &camera, &grid, &layout, &[]), image);
            let away = look([100.0, 12.0, 15.5], [200.0, 15.0, 15.0], projection);
            assert_eq!(show_bricks(&image, &away, &grid, &layout, &bricks), image);
            assert_eq!(show_camera(&image, &away, &look([0.0; 3], [9.0, 0.0, 0.0], projection), SIZE, 20.0), image);
        }
        let none = Image::transparent(UVec2::ZERO);
        assert_eq!(show_bricks(&none, &look([99.0; 3], [0.0; 3], PERSPECTIVE), &grid, &layout, &bricks), none);
    }

    #[test]
    fn edges_are_drawn_where_they_are_and_in_the_colour_of_their_level() {
        let (grid, layout, bricks) = scene();
        let image = Image::transparent(SIZE);
        for projection in [PERSPECTIVE, PARALLEL] {
            // Along an edge that all eight bricks share.
            let camera = look([100.0, 15.5, 15.5], [0.0, 15.5, 15.5], projection);
            let shown = show_bricks(&image, &camera, &grid, &layout, &bricks);
            let [r, g, b, a] = shown.at(39, 29);
            let of_level = LevelColor::of(Level(0)).linear().map(|c| c as f32 * a);
            assert!(a > 0.0 && [r, g, b].iter().zip(of_level).all(|(x, y)| (x - y).abs() < 1e-6), "{r} {g} {b} {a}");
            // From the middle of an edge to the middle of the picture there is a face without lines.
            assert_eq!(shown.at(36, 26), [0.0; 4]);
            let faint = show_bricks_faintly(&image, &camera, &grid, &layout, &bricks).at(39, 29)[3];
            assert!(0.0 < faint && faint < 0.5 * a);
        }
    }

    #[test]
    fn finer_levels_are_lighter() {
        let (grid, layout, bricks) = scene();
        let camera = look([120.0, 60.0, 70.0], [15.0; 3], PERSPECTIVE);
        let ink = |bricks: &[BrickId]| {
            let shown = show_bricks(&Image::transparent(SIZE), &camera, &grid, &layout, bricks);
            shown.pixels().iter().map(|p| p[3]).sum::<f32>()
        };
        assert!(ink(&[layout.root()]) > 1.2 * ink(&bricks[..1]) && ink(&bricks[..1]) > 0.0);
    }

    #[test]
    fn an_eye_in_a_brick_sees_lines_but_none_through_infinity() {
        let (grid, layout, bricks) = scene();
        let camera = look([8.0, 9.0, 10.0], [15.4, 15.6, 15.5], PERSPECTIVE);
        let shown = show_bricks(&picture(), &camera, &grid, &layout, &bricks);
        // The three edges at the corner that it looks at, and the edges that hide behind them: a small part of the picture.
        let n = n_changed(&shown, &picture());
        assert!((50..1500).contains(&n), "{n}");
        assert!(shown.pixels().iter().flatten().all(|c| c.is_finite()));
        // The brick around the eye alone: six of its edges end at the corner behind it.
        let own = show_bricks(&picture(), &camera, &grid, &layout, &bricks[..1]);
        assert!((20..500).contains(&n_changed(&own, &picture())));
        assert_eq!(own.at(2, 30), picture().at(2, 30));
    }

    #[test]
    fn a_camera_is_a_pyramid_with_a_roof() {
        let of = look([0.0; 3], [1.0, 0.0, 0.0], PERSPECTIVE);
        assert_eq!(pyramid(&of, SIZE, 10.0).len(), 4 + 4 + 2);
        let height = 10.0 * 0.4f64.tan();
        for [_, end] in &pyramid(&of, SIZE, 10.0)[..4] {
            let expected = DVec3::new(10.0, height * 4.0 / 3.0, height);
            assert!((end.abs() - expected).length() < 1e-12, "{end}");
        }
        let parallel = pyramid(&look([0.0; 3], [1.0, 0.0, 0.0], PARALLEL), SIZE, 10.0);
        assert_eq!(parallel.len(), 14);
        assert!(parallel.iter().flatten().all(|p| p.x == 0.0 || p.x == 10.0));
        // From behind, the base is seen around the eye.
        let behind = look([-30.0, 0.0, 0.0], [0.0; 3], PERSPECTIVE);
        let shown = show_camera(&Image::transparent(SIZE), &behind, &of, SIZE, 10.0);
        assert!(shown.at(39, 29)[3] > 0.9 && shown.at(39, 40)[3] == 0.0 && shown.at(20, 30)[3] == 0.0);
        assert!(shown.pixels().iter().all(|[r, g, b, a]| r == g && g == b && (0.0..=1.0).contains(a) && r <= a));
    }

    #[test]
    fn level_colours_differ_and_begin_again() {
        for (i, a) in LEVEL_COLORS.iter().enumerate() {
            assert!(LEVEL_COLORS[..i].iter().all(|b| a.srgb != b.srgb && a.name != b.name));
        }
        assert_eq!(LevelColor::of(Level(7)), LEVEL_COLORS[0]);
        assert!((LevelColor::of(Level(1)).linear()[0] - 0.791).abs() < 1e-3);
    }
}
