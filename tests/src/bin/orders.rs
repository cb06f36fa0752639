//! The table of observed orders of accuracy, and the closed forms.

use std::process::ExitCode;

use brickfield::{BackendKind, Validation, open_backend};
use brickfield_conformance::orders::{OrderRow, backend_images, closed_forms, grid_refinement, rays, reference_images};
use clap::Parser;

/// Prints observed orders of accuracy against the claimed ones; fails if one is off by more than 0.1
#[derive(Parser)]
struct Arguments {
    /// Backends whose absence is a failure, separated by commas: cpu, wgpu, ash
    #[arg(long, value_delimiter = ',', value_name = "BACKENDS")]
    require: Vec<BackendKind>,
    /// A part of the adapter's name, or its number
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Leave out grid refinement, which needs a volume of 384^3
    #[arg(long)]
    quick: bool,
}

fn main() -> ExitCode {
    let options = Arguments::parse();
    println!("{:<44} {:>7} {:>9} {:>9}  errors, coarsest first", "what is halved", "claimed", "observed", "halvings");
    let mut holds = print(&rays()) & print(&reference_images());
    for kind in BackendKind::ALL {
        holds &= on_backend(kind, &options);
    }
    if !options.quick {
        holds &= print(&[grid_refinement()]);
    }
    println!();
    println!("{:<44} {:>10}", "closed form, f64", "error");
    for form in closed_forms() {
        println!("{:<44} {:>10.1e}{}", form.what, form.error, if form.holds() { "" } else { "  NOT MET (1e-12)" });
        holds &= form.holds();
    }
    if holds { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn on_backend(kind: BackendKind, options: &Arguments) -> bool {
    match open_backend(kind, options.adapter.as_deref(), Validation::Off) {
        Ok(mut backend) => print(&backend_images(kind.name(), backend.as_mut())),
        Err(e) => {
            println!("picture, {kind}: {e}");
            !options.require.contains(&kind)
        }
    }
}

/// Prints rows; whether all hold.
fn print(rows: &[OrderRow]) -> bool {
    for row in rows {
        let (slope, n) = row.observed().map_or(("-".into(), 0), |o| (format!("{:.3}", o.slope), o.n_halvings));
        let errors: Vec<String> = row.errors.iter().map(|(_, e)| format!("{e:.1e}")).collect();
        let verdict = if row.holds() { "" } else { "  NOT WITHIN 0.1" };
        let claimed = if row.claims_floor() { format!("< {:.0e}", row.floor) } else { row.order.to_string() };
        println!("{:<44} {claimed:>7} {slope:>9} {n:>9}  {}{verdict}", row.what, errors.join(" "));
    }
    rows.iter().all(OrderRow::holds)
}
