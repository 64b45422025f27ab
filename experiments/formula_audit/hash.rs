//! The hash of a path, for antialiasing.

use super::{Fault, compare};
use crate::render::antialias::fingerprint::{Event, Met, PathHash};
use crate::render::antialias::mask::mask;
use std::collections::HashSet;

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "start left from the pixel before",
        number: "M13",
        component: "path hash",
        quantity: "pixels marked in a row of 64 equal paths",
        hides_where: "the first pixel of the row",
        property: "equal paths have equal hashes",
        examine: |_| {
            let row = || vec![paths(2)[7].clone(); 64];
            let marked = |f: Row| {
                let hashes = f(&row());
                let marked = mask(hashes.len(), 64, |a, b| hashes[a] != hashes[b]);
                marked.iter().filter(|&&m| m).count() as f64
            };
            // The hashes themselves, as numbers up to 1.
            let first = |f: Row| f(&row())[0] as f64 / u64::MAX as f64;
            let same = |f: Row| {
                let hashes = f(&row());
                hashes.iter().all(|&hash| hash == hashes[0])
            };
            compare(each_anew as Row, from_the_one_before, marked, first, same)
        },
    },
    Fault {
        name: "last surface left out",
        number: "M14",
        component: "path hash",
        quantity: "different hashes of two paths that end at different diffuse objects",
        hides_where: "paths that end at the same surface",
        property: "different paths have different hashes (all up to two specular events)",
        examine: |_| {
            let ends = [0, 1].map(|object| vec![(Event::Camera, place(object, true))]);
            let same_end: Vec<Path> = paths(2)
                .into_iter()
                .filter(|path| path[path.len() - 1].1.is_some())
                .map(|path| path.into_iter().chain([(Event::Mirror, None)]).collect())
                .collect();
            compare(
                ours as Hash,
                without_the_last,
                |f| different(f, &ends),
                |f| different(f, &same_end) / same_end.len() as f64,
                tells_all_paths_apart,
            )
        },
    },
    Fault {
        name: "factors 17 and 19 from 0",
        number: "M15",
        component: "path hash",
        quantity: "different hashes of two paths, reflected or refracted at the first surface",
        hides_where: "mirrors only",
        property: "different paths have different hashes (all up to two specular events)",
        examine: |_| {
            let branches = [Event::Reflect, Event::Refract]
                .map(|event| vec![(Event::Camera, place(0, true)), (event, place(1, true))]);
            let mirrors: Vec<Path> = paths(2)
                .into_iter()
                .filter(|path| path[1..].iter().all(|vertex| vertex.0 == Event::Mirror))
                .collect();
            compare(
                ours as Hash,
                by_17_and_19,
                |f| different(f, &branches),
                |f| different(f, &mirrors) / mirrors.len() as f64,
                tells_all_paths_apart,
            )
        },
    },
];

type Path = Vec<(Event, Option<Met>)>;
type Hash = fn(&Path) -> u64;
/// The hashes of a row of pixels.
type Row = fn(&[Path]) -> Vec<u64>;

fn extend(mut hash: PathHash, path: &[(Event, Option<Met>)]) -> PathHash {
    for (depth, &(event, met)) in path.iter().enumerate() {
        hash.vertex(event, depth as u32, met);
    }
    hash
}

fn ours(path: &Path) -> u64 {
    extend(PathHash::default(), path).value()
}

fn each_anew(row: &[Path]) -> Vec<u64> {
    row.iter().map(ours).collect()
}

fn from_the_one_before(row: &[Path]) -> Vec<u64> {
    let mut hash = PathHash::default();
    row.iter()
        .map(|path| {
            hash = extend(hash, path);
            hash.value()
        })
        .collect()
}

/// The original's hash has no event for a diffuse hit, where its paths end.
fn without_the_last(path: &Path) -> u64 {
    extend(PathHash::default(), &path[..path.len() - 1]).value()
}

/// The original's: at each specular event times 17 (19 for refraction) plus the surface's number, in 32 bits; 17 at the end.
fn by_17_and_19(path: &Path) -> u64 {
    let number =
        |met: Option<Met>| met.map_or(9, |met| 1 + 2 * met.object as u32 + u32::from(met.front));
    let mut hash = 0_u32;
    for (index, &(_, met)) in path.iter().enumerate() {
        let next = path.get(index + 1).map(|vertex| vertex.0);
        let factor = if next == Some(Event::Refract) { 19 } else { 17 };
        hash = hash.wrapping_mul(factor).wrapping_add(number(met));
    }
    u64::from(hash)
}

fn place(object: usize, front: bool) -> Option<Met> {
    Some(Met {
        object,
        piece: 0,
        front,
    })
}

/// Every path of up to so many specular events over both sides of four objects, and the background.
fn paths(events: usize) -> Vec<Path> {
    let objects = (0..4).flat_map(|object| [true, false].map(|front| place(object, front)));
    let places: Vec<Option<Met>> = objects.chain([None]).collect();
    let mut last: Vec<Path> = places
        .iter()
        .map(|&met| vec![(Event::Camera, met)])
        .collect();
    let mut all = last.clone();
    for _ in 0..events {
        let open = last.iter().filter(|path| path[path.len() - 1].1.is_some());
        let longer = open.flat_map(|path| {
            let events = [Event::Mirror, Event::Reflect, Event::Refract];
            let vertices = events
                .into_iter()
                .flat_map(|event| places.iter().map(move |&met| (event, met)));
            vertices.map(|vertex| path.iter().copied().chain([vertex]).collect::<Path>())
        });
        last = longer.collect();
        all.extend_from_slice(&last);
    }
    all
}

fn different(hash: Hash, paths: &[Path]) -> f64 {
    paths.iter().map(hash).collect::<HashSet<u64>>().len() as f64
}

fn tells_all_paths_apart(hash: Hash) -> bool {
    let paths = paths(2);
    different(hash, &paths) == paths.len() as f64
}
