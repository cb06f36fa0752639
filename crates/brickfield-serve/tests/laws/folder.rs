//! Files inside of the folder, and nothing else.

use std::fs;

use brickfield_serve::{ServeError, ServeOptions, Server};

use crate::ask::{ask, get, object, served};

#[test]
fn a_file_is_served_whole_with_what_caches_need() {
    let (_folder, server) = served(ServeOptions::default());
    let answer = get(&server, "/c/0");
    assert_eq!((answer.status, answer.body), (200, object()));
    let answer = get(&server, "/c/0?version=1");
    assert_eq!((answer.header("content-length"), answer.header("accept-ranges")), ("1000", "bytes"));
    let tag = answer.header("etag");
    assert!(tag.starts_with('"') && !answer.header("last-modified").is_empty());
    let again = ask(server.address(), "GET", "/c/0", &format!("if-none-match: {tag}\r\n"));
    assert_eq!((again.status, again.body.len()), (304, 0));
    let head = ask(server.address(), "HEAD", "/c/0", "");
    assert_eq!((head.status, head.header("content-length"), head.body.len()), (200, "1000", 0));
}

#[test]
fn no_spelling_of_a_path_leads_outside() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("store");
    fs::create_dir_all(folder.join("c")).unwrap();
    fs::write(outer.path().join("secret"), "secret").unwrap();
    fs::write(folder.join("c/0"), "public").unwrap();
    let server = Server::start(&folder, ServeOptions::default()).unwrap();
    let absolute = outer.path().join("secret");
    let ups = ["..", "%2e%2e", "%2E%2e", ".%2e", "%2e.", "%252e%252e", "%c0%ae%c0%ae", "%uff0e%uff0e", "..;", "...."];
    let slashes = ["/", "%2f", "%5c", "\\", "//", "/./"];
    let mut paths =
        vec![format!("/{}", absolute.display()), absolute.display().to_string(), "/c/0%00/../../secret".into()];
    for up in ups {
        for slash in slashes {
            paths.extend([format!("/{up}{slash}secret"), format!("/c/{up}{slash}{up}{slash}secret")]);
            paths.extend([format!("/c{slash}..{slash}{up}{slash}secret"), format!("http://here/{up}{slash}secret")]);
        }
    }
    for path in &paths {
        let answer = ask(server.address(), "GET", path, "");
        assert!([400, 404].contains(&answer.status), "{path}: {}", answer.status);
        assert!(!answer.body.windows(6).any(|w| w == b"secret"), "{path}");
    }
    assert_eq!(get(&server, "/c/0").body, b"public", "and it is still there");
}

#[cfg(unix)]
#[test]
fn links_lead_to_what_is_served_anyway() {
    use std::os::unix::fs::symlink;

    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("store");
    fs::create_dir_all(folder.join("c")).unwrap();
    fs::create_dir(outer.path().join("store-2")).unwrap();
    for file in ["secret", "store-2/secret", "store/c/0", "store/.hidden"] {
        fs::write(outer.path().join(file), "bytes").unwrap();
    }
    let link = |to: &str, name: &str| symlink(to, folder.join(name)).unwrap();
    link("../secret", "file");
    link("..", "up");
    link("../store-2", "beside");
    link("file", "twice");
    link(".hidden", "shown");
    link("/dev/zero", "endless");
    link("nowhere", "broken");
    link("circle", "circle");
    link("c/0", "inside");
    link("c", "folder");
    link("c/0", ".dot");
    // Opening a pipe would wait for somebody at its other end, and a socket cannot be opened.
    let _socket = std::os::unix::net::UnixListener::bind(folder.join("socket")).unwrap();
    // The folder itself may be reached by a link.
    let entry = outer.path().join("entry");
    symlink(&folder, &entry).unwrap();
    let server = Server::start(&entry, ServeOptions::default()).unwrap();
    let absent = [
        "file",
        "up/secret",
        "up/store/c/0/..",
        "beside/secret",
        "twice",
        "shown",
        "endless",
        "broken",
        ".dot",
        "socket",
    ];
    for path in absent {
        let answer = get(&server, &format!("/{path}"));
        assert_eq!((answer.status, answer.body.len()), (404, 0), "{path}");
    }
    let circle = get(&server, "/circle");
    assert!([404, 500].contains(&circle.status) && circle.body.is_empty(), "{}", circle.status);
    for path in ["inside", "folder/0", "c/0"] {
        assert_eq!(get(&server, &format!("/{path}")).status, 200, "{path}");
    }
}

#[test]
fn folders_and_names_with_a_dot_are_absent() {
    let (folder, server) = served(ServeOptions::default());
    fs::create_dir_all(folder.path().join(".store.part/c")).unwrap();
    for file in [".store.part/c/0", ".env", ".zattrs", "c/.zarray", "index.html", "c/index.html"] {
        fs::write(folder.path().join(file), "{}").unwrap();
    }
    for path in ["/", "/c", "/c/", "/c/.", "/.env", "/.store.part/c/0", "/%2eenv", "/c/gone", "/c/0/1"] {
        let answer = get(&server, path);
        assert_eq!((answer.status, answer.body.len()), (404, 0), "{path}");
    }
    for path in ["/.zattrs", "/c/.zarray", "/c/index.html"] {
        assert_eq!(get(&server, path).status, 200, "{path}");
    }
}

#[test]
fn reading_is_all_that_is_allowed() {
    let (folder, server) = served(ServeOptions::default());
    for method in ["POST", "PUT", "DELETE", "PATCH", "PROPFIND", "TRACE", "CONNECT", "NONSENSE"] {
        let answer = ask(server.address(), method, "/c/0", "content-length: 0\r\n");
        assert!([400, 405].contains(&answer.status), "{method}: {}", answer.status);
        assert!(answer.body.is_empty(), "{method}");
    }
    assert_eq!(fs::read(folder.path().join("c/0")).unwrap(), object());
}

#[test]
fn pages_of_any_origin_may_read() {
    let (_folder, server) = served(ServeOptions::default());
    let answer = ask(server.address(), "GET", "/c/0", "origin: https://viewer.example\r\nrange: bytes=0-3\r\n");
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (206, "*"));
    let exposed = answer.header("access-control-expose-headers");
    for header in ["content-range", "content-length", "accept-ranges", "etag"] {
        assert!(exposed.contains(header), "{header}: {exposed}");
    }
    let before = "origin: https://viewer.example\r\naccess-control-request-method: GET\r\n\
                  access-control-request-headers: range\r\n";
    let answer = ask(server.address(), "OPTIONS", "/c/0", before);
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, "*"));
    assert_eq!(answer.header("access-control-allow-methods"), "GET,HEAD");
    assert!(answer.header("access-control-allow-headers").contains("range"));
}

#[test]
fn what_cannot_be_served_is_an_error() {
    let (folder, server) = served(ServeOptions::default());
    let gone = Server::start(folder.path().join("gone"), ServeOptions::default());
    assert!(matches!(gone, Err(ServeError::NoFolder { .. })));
    let file = Server::start(folder.path().join("c/0"), ServeOptions::default());
    assert!(matches!(file, Err(ServeError::NoFolder { .. })));
    let taken = ServeOptions { address: server.address(), ..ServeOptions::default() };
    let error = Server::start(folder.path(), taken).unwrap_err().to_string();
    assert!(error.starts_with(&format!("cannot listen at {}: ", server.address())), "{error}");
}
