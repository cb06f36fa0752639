//! Two builds against each other: a process of each, which take turns with each contestant.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use brickfield_conformance::turns::{Bound, Claim, Offer, Ratio, Server, ServerError, Standing, take_turns};
use serde::Serialize;

use crate::{Arguments, Table};

/// How many times as long a backend may take as in the other build.
const SLOWEST: Bound = Bound::AtMost(1.03);

/// A contestant's time in this build over that in the other one.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct BuildRatio {
    #[serde(flatten)]
    offer: Offer,
    ratio: Ratio,
}

/// Times the contestants that both builds have. The claim about a backend is about the geometric mean over its contestants, round
/// by round.
pub(crate) fn against(options: &Arguments, program: &Path) -> anyhow::Result<Table> {
    let arguments = arguments(options);
    let mut this = Server::start(&std::env::current_exe()?, &arguments)?;
    let mut other = Server::start(program, &arguments)?;
    let pairs = pairs(this.offers(), other.offers());
    anyhow::ensure!(!pairs.is_empty(), "no contestant is in both builds");
    println!("time in this build / time in {}: median of {} rounds", program.display(), options.rounds);
    let mut table = Table::default();
    let mut logarithms: BTreeMap<String, (u32, Vec<f64>)> = BTreeMap::new();
    for (offer, own, foreign) in pairs {
        let times = take_turns::<ServerError>(2, options.rounds, |turn| match turn.contestant {
            0 => this.frame(own),
            _ => other.frame(foreign),
        })?;
        let ratio = Ratio::of(&times[0], &times[1]);
        println!("{:<32} {:<5} {ratio}  {}", offer.what, offer.backend, words(&ratio));
        // A frame with nothing to see is all overhead: a twentieth of its time would hide what rendering lost.
        if offer.what.contains(crate::volumes::NOTHING_TO_SEE) {
            table.builds.push(BuildRatio { offer, ratio });
            continue;
        }
        let empty = || (0, vec![0.0; times[0].len()]);
        let (n, sums) = logarithms.entry(offer.backend.clone()).or_insert_with(empty);
        *n += 1;
        sums.iter_mut().zip(times[0].iter().zip(&times[1])).for_each(|(sum, (a, b))| *sum += (a / b).ln());
        table.builds.push(BuildRatio { offer, ratio });
    }
    for (backend, (n, sums)) in logarithms {
        let means = sums.into_iter().map(|sum| (sum / f64::from(n)).exp()).collect();
        let what = format!("{backend}: this build / the other, mean of {n} contestants that render something");
        table.claims.push(Claim::of_ratio(what, Ratio::of_rounds(means), SLOWEST));
    }
    Ok(table)
}

/// The arguments with which both builds serve the same contestants.
fn arguments(options: &Arguments) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["--serve".into(), "--data".into(), options.data.clone().into()];
    arguments.extend(["--size".into(), options.size.to_string().into()]);
    arguments.extend(options.only.iter().flat_map(|only| ["--only".into(), only.into()]));
    arguments.extend(options.adapter.iter().flat_map(|adapter| ["--adapter".into(), adapter.into()]));
    arguments
}

/// The contestants of both builds, with their numbers in each. Says which are in one build only.
fn pairs(this: &[Offer], other: &[Offer]) -> Vec<(Offer, usize, usize)> {
    let number = |offers: &[Offer], offer: &Offer| offers.iter().position(|o| o == offer);
    let single = |which: &str, offer: &Offer| println!("{:<32} {:<5} in {which} only", offer.what, offer.backend);
    other.iter().filter(|offer| number(this, offer).is_none()).for_each(|offer| single("the other build", offer));
    let pair = |(own, offer): (usize, &Offer)| {
        let foreign = number(other, offer);
        if foreign.is_none() {
            single("this build", offer);
        }
        Some((offer.clone(), own, foreign?))
    };
    this.iter().enumerate().filter_map(pair).collect()
}

fn words(ratio: &Ratio) -> &'static str {
    match ratio.standing(1.0) {
        Standing::Above => "slower",
        Standing::Below => "faster",
        Standing::Undecided => "undecided",
    }
}
