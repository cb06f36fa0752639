//! The report as one page that needs nothing but itself: no server, no network, no fonts.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io;
use std::path::Path;

use base64::Engine;

use super::plot::{Against, attributes, marker, plot, rule_color};
use super::{CurveKey, HEAT_RANGE, Report, Row, SETUP_COMMAND, heat, observed_order, step_label};

/// The page of a report whose pictures lie in `folder`.
///
/// Equal pictures are embedded once.
///
/// # Errors
/// A picture that cannot be read.
pub fn page(report: &Report, folder: &Path) -> io::Result<String> {
    let mut shots = Shots { folder, size: report.scene.size, classes: BTreeMap::new(), css: String::new() };
    let pictures = pictures(report, &mut shots)?;
    let reference = reference(report, &mut shots)?;
    let sections = [
        head(report, &shots.css),
        facts(report),
        absent(report),
        filters(report),
        plots(report),
        rows_table(report),
        reference,
        pictures,
        left_out(report),
    ];
    let script = include_str!("page.js");
    Ok(format!("{}<script>\n{script}</script>\n</body>\n</html>\n", sections.concat()))
}

/// Text as HTML shows it literally.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Pictures as CSS classes: each distinct file once.
struct Shots<'a> {
    folder: &'a Path,
    size: [u32; 2],
    classes: BTreeMap<Vec<u8>, usize>,
    css: String,
}

impl Shots<'_> {
    fn div(&mut self, path: &str, what: &str) -> io::Result<String> {
        let bytes = std::fs::read(self.folder.join(path))
            .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", self.folder.join(path).display())))?;
        let next = self.classes.len();
        let uri = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
        let encoded = if self.classes.contains_key(&bytes) { None } else { Some(uri(&bytes)) };
        let class = *self.classes.entry(bytes).or_insert(next);
        if let Some(data) = encoded {
            let _ = writeln!(self.css, ".p{class}{{background-image:url(data:image/png;base64,{data})}}");
        }
        let [w, h] = self.size;
        let what = escape(what);
        Ok(format!(
            "<div class=\"shot p{class}\" style=\"aspect-ratio:{w}/{h}\" role=\"img\" aria-label=\"{what}\"></div>"
        ))
    }
}

fn head(report: &Report, picture_css: &str) -> String {
    let name = escape(&report.scene.name);
    let css = include_str!("page.css");
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Error against run time: {name}</title>\n<style>\n{css}{picture_css}</style>\n</head>\n<body>\n\
         <h1>Error against run time: {name}</h1>\n\
         <p class=\"soft\">What each step, rule, mode and backend costs, against the continuous answer.</p>\n"
    )
}

fn facts(report: &Report) -> String {
    let s = &report.scene;
    let by = |n: &[String]| n.join(" x ");
    let dims = by(&s.dims.map(|n| n.to_string()));
    let spacing = by(&s.spacing.map(|x| format!("{}", (x * 1e6).round() / 1e6)));
    let m = &report.machine;
    let mut facts = vec![
        (
            "scene",
            format!(
                "{}: {dims} voxels of {}, spacing {spacing}; picture {} x {}",
                s.name, s.scalar, s.size[0], s.size[1]
            ),
        ),
        ("camera", format!("eye {:.1?}, view {:.3?}, {}", s.eye, s.forward, s.projection)),
        ("commit", report.commit.clone()),
        ("machine", format!("{}, {} threads, {}, {} build", m.cpu, m.n_threads, m.os, m.build)),
        ("driver", report.driver.clone()),
        ("reference", format!("{}; {:.1} s", report.reference.what, report.reference.seconds)),
        ("again", s.command.clone()),
    ];
    for b in report.backends.iter().filter(|b| b.absent.is_none()) {
        let text = |t: &Option<String>| t.clone().unwrap_or_default();
        facts.push(("backend", format!("{}: {} ({})", b.backend, text(&b.adapter), text(&b.driver))));
    }
    let items: String = facts.iter().map(|(k, v)| format!("<dt>{k}</dt><dd>{}</dd>\n", escape(v))).collect();
    format!("<dl>\n{items}</dl>\n")
}

fn absent(report: &Report) -> String {
    let lines: String = report
        .backends
        .iter()
        .filter_map(|b| {
            b.absent.as_ref().map(|why| format!("<p><b>{}</b> is absent: {}</p>\n", b.backend, escape(why)))
        })
        .collect();
    if lines.is_empty() {
        return lines;
    }
    format!(
        "<div class=\"absent\">\n{lines}<p>A software Vulkan driver comes by <code>{SETUP_COMMAND}</code></p>\n</div>\n"
    )
}

fn filters(report: &Report) -> String {
    let keys: Vec<CurveKey> = report.curves().into_iter().map(|c| c.0).collect();
    let set = |of: fn(&CurveKey) -> &String| {
        keys.iter().map(of).fold(Vec::new(), |mut seen: Vec<String>, v| {
            if !seen.contains(v) {
                seen.push(v.clone());
            }
            seen
        })
    };
    let rule = |name: &str| format!("<rect y=\"5\" width=\"22\" height=\"4\" fill=\"{}\"/>", rule_color(name));
    let backend = |name: &str| marker(name, (11, 7), "#444", "#444", name);
    let mode = |name: &str| {
        let dash = if name == "fast" { " stroke-dasharray=\"5 3\"" } else { "" };
        format!("<line x2=\"22\" y1=\"7\" y2=\"7\" stroke=\"#444\" stroke-width=\"2\"{dash}/>")
    };
    let fieldset = |name: &str, values: Vec<String>, swatch: &dyn Fn(&str) -> String| {
        let label = |v: &String| {
            let swatch = swatch(v);
            format!(
                "<label><input type=\"checkbox\" checked name=\"{name}\" value=\"{v}\"><svg class=\"swatch\" viewBox=\"0 0 22 14\">{swatch}</svg>{v}</label>"
            )
        };
        format!("<fieldset><legend>{name}</legend>{}</fieldset>\n", values.iter().map(label).collect::<String>())
    };
    format!(
        "<div class=\"filters\">\n{}{}{}</div>\n",
        fieldset("rule", set(|k| &k.rule), &rule),
        fieldset("backend", set(|k| &k.backend), &backend),
        fieldset("mode", set(|k| &k.mode), &mode)
    )
}

fn plots(report: &Report) -> String {
    let svg = |against| plot(report, against).unwrap_or_else(|e| format!("<p>{e}</p>\n"));
    format!(
        "<h2>Error against time</h2>\n<p>Lower and further left is better. One curve per rule (colour), backend (mark) and mode \
         (line); along a curve the step falls to the right. Gold marks the Pareto front: no other measurement has both less \
         error and less time.</p>\n<div class=\"plot\">\n{}</div>\n\
         <h2>Error against step</h2>\n<p>The slope is a rule's order. Data on a grid has kinks at every cell, which holds all \
         rules to order 2; smooth fields show more.</p>\n<div class=\"plot\">\n{}</div>\n{}",
        svg(Against::Time),
        svg(Against::Step),
        orders(report)
    )
}

/// A table of observed orders: rules against backends and modes.
fn orders(report: &Report) -> String {
    let curves = report.curves();
    let rows: String = curves
        .iter()
        .filter_map(|(key, rows)| {
            let order = observed_order(rows)?;
            let (data, least) = (attributes(key), rows.iter().map(|r| r.rmse).fold(f64::INFINITY, f64::min));
            Some(format!(
                "<tr {data}><td>{}</td><td>{}</td><td>{}</td><td></td><td>{order:.2}</td><td data-value=\"{least:e}\">{least:.2e}</td></tr>\n",
                key.rule, key.backend, key.mode
            ))
        })
        .collect();
    format!(
        "<details><summary>Observed orders</summary>\n<table>\n<thead><tr><th>rule</th><th>backend</th><th>mode</th><th></th><th>observed order</th><th>least RMSE</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</details>\n"
    )
}

fn rows_table(report: &Report) -> String {
    let body: String = report.curves().into_iter().flat_map(|(_, rows)| rows).map(table_row).collect();
    format!(
        "<h2>Measurements</h2>\n<p>Times are medians over frames that took turns with all others, with the least and the \
         greatest. Errors are over all pixels and {}; colour differences are CIE 1976 L*u*v* over the scene's \
         background. Click a heading to sort.</p>\n<div class=\"scroll\"><table>\n<thead><tr><th>front</th><th>backend</th>\
         <th>mode</th><th>rule</th><th>step</th><th>samples</th><th>median ms</th><th>min</th><th>max</th><th>device ms</th>\
         <th>frames</th><th>RMSE</th><th>max</th><th>99.9 %</th><th>&Delta;E mean</th><th>&Delta;E 95 %</th></tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n",
        report.channels.words()
    )
}

fn table_row(row: &Row) -> String {
    let cell = |value: f64, text: String| format!("<td data-value=\"{value:e}\">{text}</td>");
    let ms = |v: f64| cell(v, format!("{v:.2}"));
    let error = |v: f64| cell(v, format!("{v:.2e}"));
    let device = row.device_ms.map_or_else(|| "<td></td>".to_owned(), ms);
    let (class, mark) = if row.on_front { (" class=\"on-front\"", "&#9679;") } else { ("", "") };
    let numbers = [row.rmse, row.max_abs, row.p999, row.delta_e_mean, row.delta_e_p95].map(error).concat();
    format!(
        "<tr {}{class}><td>{mark}</td><td title=\"{}\">{}</td><td>{}</td><td>{}</td>{}{}{}{}{}{device}<td>{}</td>{numbers}</tr>\n",
        attributes(&row.curve()),
        escape(&row.adapter),
        row.backend,
        row.mode,
        row.rule,
        cell(row.step_voxels, step_label(row.step_voxels)),
        cell(row.samples as f64, format!("{:.2} M", row.samples as f64 * 1e-6)),
        ms(row.median_ms),
        ms(row.min_ms),
        ms(row.max_ms),
        row.n_frames
    )
}

fn reference(report: &Report, shots: &mut Shots<'_>) -> io::Result<String> {
    let shot = shots.div(&report.reference.png, "the reference")?;
    let stops: Vec<String> = (0..=24).map(|i| css_color(heat_at(f64::from(i) / 24.0))).collect();
    let [low, high] = HEAT_RANGE;
    Ok(format!(
        "<h2>Pictures</h2>\n<figure class=\"reference\">{shot}<figcaption>the reference: {}</figcaption></figure>\n\
         <p>Under each picture its difference from the reference, each pixel's greatest channel on one logarithmic scale:</p>\n\
         <div class=\"scale\" style=\"background:linear-gradient(to right,{})\"></div>\n\
         <div class=\"scale-ends\"><span>{low:.0e}</span><span>1e-4</span><span>{high:.0e}</span></div>\n",
        escape(&report.reference.what),
        stops.join(",")
    ))
}

/// The colour at a share of the (logarithmic) scale.
fn heat_at(share: f64) -> [u8; 3] {
    let [low, high] = HEAT_RANGE.map(f64::log10);
    heat(10f64.powf(low + share * (high - low)))
}

fn css_color([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn pictures(report: &Report, shots: &mut Shots<'_>) -> io::Result<String> {
    let mut html = String::new();
    for (key, rows) in report.curves() {
        let open = if rows.iter().any(|r| r.on_front) { " open" } else { "" };
        let figures: io::Result<String> = rows.iter().map(|r| figure(r, shots)).collect();
        let _ = writeln!(
            html,
            "<details {}{open}><summary>{} {} {}</summary>\n<div class=\"strip\">\n{}</div>\n</details>",
            attributes(&key),
            key.backend,
            key.mode,
            key.rule,
            figures?
        );
    }
    Ok(html)
}

fn figure(row: &Row, shots: &mut Shots<'_>) -> io::Result<String> {
    let step = step_label(row.step_voxels);
    let picture = shots.div(&row.png, &format!("{} {} {} step {step}", row.backend, row.mode, row.rule))?;
    let difference = shots.div(&row.difference_png, "its difference from the reference")?;
    let class = if row.on_front { " class=\"on-front\"" } else { "" };
    Ok(format!(
        "<figure{class}>{picture}{difference}<figcaption><b>step {step}</b> {:.1} ms<br>RMSE {:.2e}, max {:.1e}</figcaption></figure>\n",
        row.median_ms, row.rmse, row.max_abs
    ))
}

fn left_out(report: &Report) -> String {
    if report.left_out.is_empty() {
        return String::new();
    }
    let line = |l: &super::LeftOut| {
        let step = step_label(l.step_voxels);
        format!("<li>{} {} {} step {step}: {}</li>\n", l.backend, l.mode, l.rule, escape(&l.reason))
    };
    format!("<h2>Not measured</h2>\n<ul>\n{}</ul>\n", report.left_out.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    fn with_pictures(report: &Report) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("images")).unwrap();
        let pngs = report.rows.iter().flat_map(|r| [&r.png, &r.difference_png]).chain([&report.reference.png]);
        for png in pngs {
            let bytes: &[u8] = if png.contains("difference") { b"difference" } else { b"picture" };
            std::fs::write(folder.path().join(png), bytes).unwrap();
        }
        folder
    }

    #[test]
    fn the_page_needs_nothing_but_itself() {
        let report = report();
        let html = page(&report, with_pictures(&report).path()).unwrap();
        let outside = ["src=\"http", "href=", "url(http", "@import", "<link", "<script src"];
        assert!(outside.iter().all(|o| !html.contains(o)));
        assert_eq!(html.matches("data:image/png;base64,").count(), 2, "equal pictures are embedded once");
        assert_eq!(html.matches("<figure").count(), report.rows.len() + 1);
        assert!(html.contains("no Vulkan &lt;driver&gt; &amp; no loader") && html.contains(SETUP_COMMAND));
        for fact in [&report.commit, &report.machine.cpu, &report.driver] {
            assert!(html.contains(&escape(fact)), "{fact}");
        }
    }

    #[test]
    fn a_missing_picture_is_named() {
        let report = report();
        let folder = with_pictures(&report);
        std::fs::remove_file(folder.path().join(&report.rows[0].png)).unwrap();
        assert!(page(&report, folder.path()).unwrap_err().to_string().contains(&report.rows[0].png));
    }
}
