//! Real structured grids. The expected numbers are of a plain loop over the files' bytes, without this crate.

use std::path::Path;

use brickfield_core::StructuredGrid;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::{GridOptions, OpenedGrids, open_grid};
use libtest_mimic::Failed;

/// A file, and all that is known of it.
pub(crate) struct RealGrid {
    pub(crate) path: &'static str,
    solution: Option<&'static str>,
    n_nodes: [u32; 3],
    n_holes: usize,
    /// Names, least and greatest values, holes left out.
    ranges: &'static [(&'static str, f32, f32)],
    /// A node, its position, and its values.
    node: ([u32; 3], [f64; 3], &'static [f32]),
    /// The sum of the first field, holes left out.
    sum: f64,
    n_notes: usize,
}

/// The real grids.
pub(crate) const GRIDS: &[RealGrid] = &[
    RealGrid {
        path: "curvilinear/combxyz.bin",
        solution: Some("curvilinear/combq.bin"),
        n_nodes: [57, 33, 25],
        n_holes: 0,
        ranges: &[
            ("density", 0.197_813_1, 0.710_419_24),
            ("momentum x", -368.541_17, 368.377_96),
            ("momentum y", -392.289_58, 380.310_2),
            ("momentum z", -287.270_32, 297.851_04),
            ("stagnation energy", 0.0, 0.0),
        ],
        node: (
            [28, 16, 12],
            [8.664_497_375_488_281, 0.0, 31.128_948_211_669_922],
            &[0.231_441_62, 125.048_72, 58.606_773, 59.843_758, 0.0],
        ),
        sum: 14_143.992_722_317_576,
        n_notes: 1,
    },
    RealGrid {
        path: "curvilinear/bluntfinxyz.bin",
        solution: Some("curvilinear/bluntfinq.bin"),
        n_nodes: [40, 32, 32],
        n_holes: 0,
        ranges: &[
            ("density", 0.1926, 4.9775),
            ("momentum x", -2.1835, 5.7903),
            ("momentum y", -0.325_25, 3.5454),
            ("momentum z", -3.7339, 1.5029),
            ("stagnation energy", 0.768_956_96, 25.161),
        ],
        node: (
            [20, 16, 16],
            [0.387_307_107_448_577_9, 0.798_346_400_260_925_3, 0.268_472_403_287_887_6],
            &[0.879_96, 1.3815, 0.599_99, -0.984_85, 4.8735],
        ),
        sum: 47_453.369_957_670_57,
        n_notes: 2,
    },
    RealGrid {
        path: "curvilinear/RectGrid2.vtk",
        solution: None,
        n_nodes: [47, 33, 11],
        n_holes: 0,
        ranges: &[
            ("scalars", 0.0, 10.3964),
            ("vectors x", -0.157_034, 3.043_19),
            ("vectors y", -0.392_006, 0.392_006),
            ("vectors z", -5.361_45, 10.0787),
        ],
        node: ([20, 16, 5], [-0.182_291_999_459_266_66, 0.0, 0.5], &[7.893_12, 1.636_16, 0.0, 7.721_68]),
        sum: 9_962.405_559_389_153,
        n_notes: 0,
    },
    RealGrid {
        path: "dem/N00E010.hgt",
        solution: None,
        n_nodes: [1201, 1201, 1],
        n_holes: 0,
        ranges: &[("elevation", 1.0, 1005.0)],
        // Row 300 from the north.
        node: ([700, 900, 0], [64_861.326_7, 83_396.309_8, 0.0], &[827.0]),
        sum: 542_345_959.0,
        n_notes: 1,
    },
    RealGrid {
        path: "dem/SainteHelens.dem",
        solution: None,
        n_nodes: [327, 466, 1],
        // 327 x 466 nodes, 148885 samples.
        n_holes: 3497,
        ranges: &[("elevation", 682.0, 2543.0)],
        // The summit.
        node: ([148, 246, 0], [557_820.0 + 148.0 * 30.0, 5_108_010.0 + 246.0 * 30.0, 0.0], &[2543.0]),
        sum: 192_320_028.0,
        n_notes: 0,
    },
];

/// Opens the grid, and holds it against the table.
pub(crate) fn is_as_expected(folder: &Path, path: &str) -> Result<(), Failed> {
    let expected = GRIDS.iter().find(|grid| path.ends_with(grid.path)).ok_or("not in the table")?;
    let mut options = GridOptions::default();
    options.solution = expected.solution.map(|name| folder.join(name));
    let opened = open_grid(&folder.join(expected.path), &options)?;
    let [grid] = &opened.grids[..] else { return Err(format!("{} grids", opened.grids.len()).into()) };
    let differences = differences(&opened, grid, expected);
    if differences.is_empty() { Ok(()) } else { Err(differences.join("; ").into()) }
}

fn differences(opened: &OpenedGrids, grid: &StructuredGrid, expected: &RealGrid) -> Vec<String> {
    let mut differences = Vec::new();
    let mut expect = |what: &str, agrees: bool, found: String| {
        if !agrees {
            differences.push(format!("{what} {found}"));
        }
    };
    expect("nodes", grid.n_nodes() == UVec3::from(expected.n_nodes), grid.n_nodes().to_string());
    expect("notes", opened.notes.len() == expected.n_notes, format!("{:?}", opened.notes));
    let holes = grid.holes().unwrap_or_default();
    let n_holes = holes.iter().filter(|hole| **hole).count();
    expect("holes", n_holes == expected.n_holes, n_holes.to_string());
    let is_there = |i: usize| !holes.get(i).copied().unwrap_or(false);
    let there =
        |values: &[f32]| -> Vec<f32> { (0..values.len()).filter(|i| is_there(*i)).map(|i| values[i]).collect() };
    let ranges: Vec<(&str, f32, f32)> = grid
        .fields()
        .iter()
        .map(|field| {
            let values = there(&field.values);
            let least = values.iter().copied().fold(f32::INFINITY, f32::min);
            (field.name.as_str(), least, values.iter().copied().fold(f32::NEG_INFINITY, f32::max))
        })
        .collect();
    expect("ranges", ranges == expected.ranges, format!("{ranges:?}"));
    let (node, position, values) = expected.node;
    let found = grid.position(node.into());
    expect("position", (found - DVec3::from(position)).length() < 1e-3, format!("{found:?}"));
    let found: Vec<f32> = grid.fields().iter().map(|field| field.values[grid.number(node.into())]).collect();
    expect("values", found == values, format!("{found:?}"));
    let sum: f64 = there(&grid.fields()[0].values).into_iter().map(f64::from).sum();
    expect("sum", (sum - expected.sum).abs() < 1e-6, sum.to_string());
    differences
}
