//! Ranges, and what is no range.

use brickfield_serve::ServeOptions;

use crate::ask::{ask, get_range, object, served};

#[test]
fn a_range_is_answered_by_its_bytes() {
    let (_folder, server) = served(ServeOptions::default());
    for (range, stated, bytes) in [
        ("bytes=0-0", "bytes 0-0/1000", 0..1),
        ("bytes=10-19", "bytes 10-19/1000", 10..20),
        ("bytes=990-", "bytes 990-999/1000", 990..1000),
        ("bytes=-5", "bytes 995-999/1000", 995..1000),
        ("bytes=990-5000", "bytes 990-999/1000", 990..1000),
    ] {
        let answer = get_range(&server, range);
        assert_eq!((answer.status, answer.header("content-range")), (206, stated), "{range}");
        assert_eq!(answer.body, &object()[bytes], "{range}");
    }
    let head = ask(server.address(), "HEAD", "/c/0", "range: bytes=4-7\r\n");
    assert_eq!(
        (head.header("content-range"), head.header("content-length"), head.body.len()),
        ("bytes 4-7/1000", "4", 0)
    );
}

#[test]
fn what_is_no_single_range_of_the_object_gives_no_byte() {
    let (_folder, server) = served(ServeOptions::default());
    let many: Vec<String> = (0..1000).map(|i| format!("{i}-{i}")).collect();
    let overlapping = vec!["0-"; 2000].join(",");
    for range in [
        "bytes=1000-",
        "bytes=1000-1001",
        "bytes=7-3",
        "bytes=0-1,4-5",
        "bytes=0-999,0-999",
        "bytes=18446744073709551616-",
        "bytes=99999999999999999999999999-99999999999999999999999999",
        "bytes=-0",
        "bytes=",
        "bytes=-",
        "bytes=a-b",
        "bytes=0x1-0x2",
        "bytes=--5",
        "bytes=1-2-3",
        &format!("bytes={}", many.join(",")),
        &format!("bytes={overlapping}"),
    ] {
        let answer = get_range(&server, range);
        let told = format!("{range:.60}: {answer:?}");
        assert_eq!(answer.status, 416, "{told}");
        assert_eq!(answer.header("content-range"), "bytes */1000", "{told}");
    }
    // Numbers that a file cannot reach are its end, and other units are none of ours.
    assert_eq!(get_range(&server, "bytes=0-18446744073709551615").body, object());
    for other in ["items=0-3", "lines=0-3"] {
        assert!([200, 416].contains(&get_range(&server, other).status), "{other}");
    }
}
