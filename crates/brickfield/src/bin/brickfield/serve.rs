//! `brickfield serve`.

use std::time::Duration;

use brickfield::serve::{ServeOptions, Server, Throttle};

use crate::{Failure, ServeArgs, print};

/// Ends with the process: the store is only read.
pub(crate) fn run(args: &ServeArgs) -> Result<(), Failure> {
    let throttle = throttle(args)?;
    let options = ServeOptions { address: args.address, throttle, ..ServeOptions::default() };
    let server = Server::start(&args.store, options).map_err(Failure::usage)?;
    print(&format!("{} serves {}, for trying out; Ctrl-C ends it\n", server.url(), args.store.display()))?;
    server.wait();
    Ok(())
}

/// None if neither of its two numbers is given; the link is as fast as it can be if only the latency is.
fn throttle(args: &ServeArgs) -> Result<Option<Throttle>, Failure> {
    if args.mbit.is_none() && args.latency_ms.is_none() {
        return Ok(None);
    }
    let bits_per_second = args.mbit.map_or(f64::INFINITY, |mbit| mbit * 1e6);
    let seconds = args.latency_ms.unwrap_or(0.0) / 1e3;
    let latency = Duration::try_from_secs_f64(seconds).map_err(Failure::usage)?;
    Ok(Some(Throttle { bits_per_second, latency }))
}
