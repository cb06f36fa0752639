//! Classification of averages against prefiltered classification: error at equal blocks and at equal bytes.

use brickfield::frame::{Backend, Join, Mode};
use brickfield::lod::{BlockSelection, BudgetSize};
use brickfield::{BlockResidency, BlockStyle, Classification, Scene, prepare_blocks};
use brickfield_core::{Companion, Image, Interblock};
use serde::Serialize;

use super::LjungArgs;
use super::data::{DataSet, data_sets};
use super::figures::{difference, file_name, full};
use super::schemes::style;
use super::table::answer;
use crate::compare::rivals::Rivals;
use crate::metrics::{delta_e, errors};
use crate::paper::panels::{beside, stacked};
use crate::paper::{Missed, PaperError, print};

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct ClassifyRow {
    data: String,
    /// Bytes of the volume for each byte of samples and spreads.
    budget: f64,
    classification: &'static str,
    /// Bytes of samples and of spreads.
    n_bytes: u64,
    rmse: f64,
    delta_e_mean: f64,
    delta_e_95: f64,
}

/// The ratio of the pictures.
const OF_PICTURES: f64 = 32.0;
/// From this mean Delta E on prefiltering is claimed to save some: below it, nobody sees a difference.
const VISIBLE: f64 = 1.0;

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, blocks of {}, maximum distance. Errors are against the continuous integral at full resolution. Prefiltered: with the mean's blocks, for\n\
         a byte more of each sample; and with fewer samples, for the mean's bytes.\n",
        args.common.size.x, args.common.size.y, args.blocks
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    let Some(backend) = rivals.present.last_mut() else { return Ok(missed) };
    for data_set in data_sets(args)? {
        let of_data_set = of_data_set(args, backend.as_mut(), &data_set?)?;
        missed.extend(of_data_set.chunks_exact(METHODS.len()).filter_map(claim));
        rows.extend(of_data_set);
    }
    args.common.write_rows("classify.json", &rows)?;
    Ok(missed)
}

/// How blocks are drawn and chosen.
#[derive(Clone, Copy, PartialEq)]
enum Method {
    Mean,
    /// With the blocks of the mean.
    SameBlocks,
    /// With as many bytes as the mean.
    SameBytes,
}

const METHODS: [Method; 3] = [Method::Mean, Method::SameBlocks, Method::SameBytes];

impl Method {
    const fn name(self) -> &'static str {
        match self {
            Method::Mean => "mean",
            Method::SameBlocks => "prefiltered, same blocks",
            Method::SameBytes => "prefiltered, same bytes",
        }
    }

    fn style(self) -> BlockStyle {
        let of_mean = style(Join::Blend(Interblock::MaximumDistance));
        match self {
            Method::Mean => of_mean,
            Method::SameBlocks | Method::SameBytes => {
                BlockStyle { classification: Classification::Prefiltered, ..of_mean }
            }
        }
    }

    fn select(self, data: &DataSet, ratio: f64) -> Result<BlockSelection, PaperError> {
        let companion_bytes = match self {
            Method::Mean | Method::SameBlocks => 0,
            Method::SameBytes => Companion::Spread.n_bytes() as u8,
        };
        data.select_beside(BudgetSize::Ratio(ratio), companion_bytes)
    }
}

fn of_data_set(args: &LjungArgs, backend: &mut dyn Backend, data: &DataSet) -> Result<Vec<ClassifyRow>, PaperError> {
    let scene = data.scene(args, Mode::Exact)?;
    let answer = answer(data, &scene);
    let mut rows = Vec::new();
    for ratio in &args.ratios {
        print(&format!(
            "{}, {ratio}:1\n  method                        MiB      RMSE   dE mean  dE 95 %   dE saved per MiB",
            data.name
        ))?;
        let mut pictures = vec![full(&answer)];
        for method in METHODS {
            let (image, n_bytes) = picture(backend, data, &scene, method, *ratio)?;
            let colors = delta_e(&image, &answer, [0.0; 3])?;
            let row = ClassifyRow {
                data: data.name.clone(),
                budget: *ratio,
                classification: method.name(),
                n_bytes,
                rmse: errors(&image, &answer)?.rmse,
                delta_e_mean: colors.mean,
                delta_e_95: colors.percentile_95,
            };
            let of_mean = rows.len() - rows.len() % METHODS.len();
            print(&line(&row, rows.get(of_mean)))?;
            rows.push(row);
            pictures.push(image);
        }
        if *ratio == OF_PICTURES {
            let differences: Vec<Image<f32>> = pictures.iter().map(|picture| difference(picture, &answer)).collect();
            let what = format!(
                "{} at {ratio}:1: full resolution, mean, prefiltered with the same blocks, with the same bytes; below, Delta E",
                data.name
            );
            let name = format!("classify-{}", file_name(&data.name));
            args.common.write_picture(&name, &stacked(&[beside(&pictures), beside(&differences)]), &what)?;
        }
    }
    Ok(rows)
}

/// The picture of a method, and the bytes of its samples and spreads.
fn picture(
    backend: &mut dyn Backend,
    data: &DataSet,
    scene: &Scene,
    method: Method,
    ratio: f64,
) -> Result<(Image<f32>, u64), PaperError> {
    let levels = method.select(data, ratio)?.levels;
    let plan = prepare_blocks(&data.blocks, scene, levels.levels(), method.style(), &mut BlockResidency::default())?;
    let n_bytes = plan.field().slots().n_bytes() + plan.spreads().map_or(0, |spreads| spreads.n_bytes());
    let name = backend.describe().backend;
    let frame = backend.render(&plan).map_err(|source| PaperError::Render { backend: name, source })?;
    Ok((frame.image, n_bytes as u64))
}

fn line(row: &ClassifyRow, of_mean: Option<&ClassifyRow>) -> String {
    let mib = |n_bytes: u64| n_bytes as f64 / f64::from(1 << 20);
    let saved = of_mean.map_or(String::new(), |mean| {
        let (less, more) = (mean.delta_e_mean - row.delta_e_mean, mib(row.n_bytes) - mib(mean.n_bytes));
        match more > 0.01 * mib(mean.n_bytes) {
            true => format!("{:.2}", less / more),
            false => format!("{less:.3} for no more"),
        }
    });
    format!(
        "  {:<26} {:>6.3}  {:.2e} {:>9.3} {:>8.2}   {saved}",
        row.classification,
        mib(row.n_bytes),
        row.rmse,
        row.delta_e_mean,
        row.delta_e_95
    )
}

/// With the same blocks prefiltering saves colour difference where there is some to save. For the same bytes it may not: some volumes are
/// better served by more samples.
fn claim(rows: &[ClassifyRow]) -> Option<Missed> {
    let (mean, prefiltered) = (&rows[0], &rows[1]);
    let is_missed = mean.delta_e_mean >= VISIBLE && prefiltered.delta_e_mean >= mean.delta_e_mean;
    is_missed.then(|| {
        Missed::of_pictures(format!(
            "{} at {}:1: {} {:.3}, of means {:.3} mean Delta E",
            prefiltered.data,
            prefiltered.budget,
            prefiltered.classification,
            prefiltered.delta_e_mean,
            mean.delta_e_mean
        ))
    })
}
