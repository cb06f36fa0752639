//! Section 3.1: the paper found subsampling better than averaging on its data. This part repeats the comparison on ours.

use brickfield::bricks::Downsampling;
use brickfield_core::BrickSide;

use super::LamarArgs;
use super::measure::{answer, distance};
use super::scenes::{data_sets, geometries, scene, tree, views};
use crate::paper::{Missed, PaperError, print};
use crate::turns::Contestant;

pub(super) fn run(args: &LamarArgs) -> Result<Vec<Missed>, PaperError> {
    print("Bricks of 16, ray caster on the cpu, errors against the continuous integral at full resolution.\n")?;
    print("data               view      RMSE: subsampled  averaged   colour difference: subsampled  averaged  better")?;
    let mut cpu = brickfield::cpu::CpuBackend::new();
    let mut n_won = [0, 0];
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let trees =
            [Downsampling::Subsample, Downsampling::Average].map(|how| tree(&data_set.volume, BrickSide::S16, how));
        let [subsampled, averaged] = trees;
        let trees = [subsampled?, averaged?];
        for (view, camera) in views(&data_set, args.common.size)? {
            let scene = scene(args, &data_set.transfer, camera, geometries(args)[3], &args.detail);
            let answer = answer(&data_set.volume, &scene);
            let mut errors = Vec::new();
            for tree in &trees {
                let frame = Contestant::new(tree, scene.clone()).frame(&mut cpu)?;
                errors.push(distance(&frame.image, &answer)?);
            }
            let winner = usize::from(errors[1].rmse < errors[0].rmse);
            n_won[winner] += 1;
            print(&format!(
                "{:<18} {:<9} {:>16.3e} {:>9.3e} {:>30.2} {:>9.2}  {}",
                data_set.name,
                view,
                errors[0].rmse,
                errors[1].rmse,
                errors[0].delta_e_mean,
                errors[1].delta_e_mean,
                ["subsampling", "averaging"][winner]
            ))?;
        }
    }
    print(&format!("\nby RMSE, subsampling is better in {} views and averaging in {}", n_won[0], n_won[1]))?;
    Ok(Vec::new())
}
