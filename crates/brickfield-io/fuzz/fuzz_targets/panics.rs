/// Panics of third-party decoders are caught by the reader, and are no finding; ours abort.
pub fn abort_on_ours() {
    std::panic::set_hook(Box::new(|info| {
        let is_ours = info.location().is_some_and(|at| !at.file().contains("registry"));
        if is_ours {
            eprintln!("{info}");
            std::process::abort();
        }
    }));
}
