//! Parts of a store that were read, within a bound: the ones that were used least recently make room. The last one always stays: whoever reads
//! a large part box by box unpacks it once.

use std::collections::{BTreeMap, HashMap};
use std::hash::{BuildHasher, RandomState};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::parts::Kept;

/// What of which array.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    pub(super) array: usize,
    pub(super) kind: Kind,
    pub(super) at: Vec<u64>,
}

/// What is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    /// Where the parts of a shard lie.
    Index,
    /// The samples of a part.
    Samples,
    /// The samples of a part that is stored as details: those of the next level are asked for meanwhile.
    Refined,
}

pub(super) struct Cache {
    held: Mutex<Held>,
    /// Whoever reads something holds its lock, so that nobody else reads it at the same time. Each kind has locks of its own, because
    /// what is of one kind is read by those who hold the lock of another: refined samples, then samples, then an index.
    locks: [[Mutex<()>; N_LOCKS]; 3],
    hasher: RandomState,
}

const N_LOCKS: usize = 64;

struct Held {
    entries: HashMap<Key, (Kept, u64)>,
    /// By the time of the last use.
    order: BTreeMap<u64, Key>,
    now: u64,
    n_bytes: u64,
    max_bytes: u64,
}

impl Cache {
    pub(super) fn new(max_bytes: u64) -> Cache {
        let held = Held { entries: HashMap::new(), order: BTreeMap::new(), now: 0, n_bytes: 0, max_bytes };
        let locks = std::array::from_fn(|_| std::array::from_fn(|_| Mutex::new(())));
        Cache { held: Mutex::new(held), locks, hasher: RandomState::new() }
    }

    /// What is held under a key, else what `read` makes, which is held then.
    pub(super) fn get_or<E>(&self, key: Key, read: impl FnOnce() -> Result<Kept, E>) -> Result<Kept, E> {
        if let Some(kept) = locked(&self.held).get(&key) {
            return Ok(kept);
        }
        let lock = self.hasher.hash_one(&key) as usize % N_LOCKS;
        let _only_here = locked(&self.locks[key.kind as usize][lock]);
        if let Some(kept) = locked(&self.held).get(&key) {
            return Ok(kept);
        }
        let kept = read()?;
        locked(&self.held).insert(key, kept.clone());
        Ok(kept)
    }

    pub(super) fn n_bytes(&self) -> u64 {
        locked(&self.held).n_bytes
    }
}

/// What a panic of another thread leaves is whole: entries are put in one by one.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Held {
    fn get(&mut self, key: &Key) -> Option<Kept> {
        let (kept, used) = self.entries.get_mut(key)?;
        let key = self.order.remove(used)?;
        self.now += 1;
        *used = self.now;
        self.order.insert(self.now, key);
        Some(kept.clone())
    }

    fn insert(&mut self, key: Key, kept: Kept) {
        let n_bytes = kept.n_bytes();
        while self.n_bytes + n_bytes > self.max_bytes {
            let Some((_, oldest)) = self.order.pop_first() else { break };
            self.n_bytes -= self.entries.remove(&oldest).map_or(0, |(kept, _)| kept.n_bytes());
        }
        self.now += 1;
        self.n_bytes += n_bytes;
        self.order.insert(self.now, key.clone());
        self.entries.insert(key, (kept, self.now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn key(i: u64) -> Key {
        Key { array: 0, kind: Kind::Samples, at: vec![i] }
    }

    #[test]
    fn the_least_recently_used_makes_room() {
        let cache = Cache::new(3 * 1128);
        let mut n_read = 0;
        for i in [0, 1, 2, 0, 3, 0, 2, 1] {
            let read = || {
                n_read += 1;
                Ok::<_, ()>(Kept::Samples(Some(Arc::new(vec![i as u8; 1000]))))
            };
            let Kept::Samples(Some(samples)) = cache.get_or(key(i), read).unwrap() else { panic!("samples") };
            assert_eq!(samples[0], i as u8);
            assert!(cache.n_bytes() <= 3 * 1128);
        }
        // 3 makes 1 leave, which makes 3 leave.
        assert_eq!(n_read, 5);
        let large = || Ok::<_, ()>(Kept::Samples(Some(Arc::new(vec![0; 4000]))));
        cache.get_or(key(9), large).unwrap();
        // Larger than all, it stays until the next one comes.
        assert_eq!(cache.n_bytes(), 4128);
        cache.get_or(key(9), || Err("read again")).unwrap();
        assert_eq!(cache.get_or(key(7), || Err("gone")).err(), Some("gone"));
    }
}
