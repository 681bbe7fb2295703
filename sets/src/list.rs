//! Lists that hand their memory on, so that a step of a filter does not ask the allocator.
//!
//! What a step makes has about the sizes of what the step before made and dropped. A [`List`] takes its memory from a
//! shelf of its thread and gives it back when it is dropped; after some steps what there is to take is on the
//! shelf, unless a list is longer than all before. Memory is kept by powers of two, at most [`MOST`] bytes of each, and
//! given up with the thread.

use crate::Interval;
use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Bytes of entries that a thread keeps at most of each power of two and type; what is dropped beyond goes back to the
/// allocator.
pub const MOST: usize = 4 << 20;

/// Where an iterator knows its length within bounds only, the upper one is believed up to so many bytes.
const FORESEEN: usize = 1 << 16;

/// The smallest list has room for 2² entries.
const SMALLEST: u32 = 2;

/// The longest that are kept have fewer than two to this power.
const CLASSES: usize = 23;

/// A `Vec` whose memory is taken from its thread and given back to it.
///
/// It dereferences to the `Vec`, and its own methods stand before those that would grow the `Vec` past its room;
/// others that grow (`insert`, `append`) ask the allocator.
///
/// ```
/// use zonobench_sets::List;
/// let mut list: List<f64> = (0..3).map(f64::from).collect();
/// list.push(0.5);
/// assert_eq!(list, [0.0, 1.0, 2.0, 0.5]);
/// assert_eq!(List::filled(1.0, 2).into_vec(), vec![1.0, 1.0]);
/// ```
pub struct List<T: 'static>(Vec<T>);

impl<T: 'static> List<T> {
    /// Without entries or memory.
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// Without entries, with room for `capacity` or more.
    pub fn with_capacity(capacity: usize) -> Self {
        Self(taken(capacity))
    }

    /// Room for `more` entries beyond those there are; twice the room if there was too little.
    #[inline]
    pub fn reserve(&mut self, more: usize) {
        if self.0.capacity() - self.0.len() < more {
            self.grow(more);
        }
    }

    #[cold]
    fn grow(&mut self, more: usize) {
        let needed = self.0.len().saturating_add(more);
        let mut longer = taken(needed.max(self.0.capacity().saturating_mul(2)));
        longer.append(&mut self.0);
        give_back(std::mem::replace(&mut self.0, longer));
    }

    /// One entry more.
    #[inline]
    pub fn push(&mut self, x: T) {
        self.reserve(1);
        self.0.push(x);
    }

    /// These entries more.
    pub fn extend(&mut self, entries: impl IntoIterator<Item = T>) {
        let entries = entries.into_iter();
        match entries.size_hint() {
            (least, Some(most)) if most == least || most <= FORESEEN / size_of::<T>().max(1) => {
                self.reserve(most);
                self.0.extend(entries);
            }
            _ => entries.for_each(|x| self.push(x)),
        }
    }

    /// The entries as a `Vec`, not copied.
    pub fn into_vec(mut self) -> Vec<T> {
        std::mem::take(&mut self.0)
    }
}

impl<T: Clone + 'static> List<T> {
    /// `n` times `x`.
    pub fn filled(x: T, n: usize) -> Self {
        let mut list = Self::with_capacity(n);
        list.0.resize(n, x);
        list
    }

    /// Cut to `n` entries, or filled up to them with `x`.
    #[inline]
    pub fn resize(&mut self, n: usize, x: T) {
        self.reserve(n.saturating_sub(self.0.len()));
        self.0.resize(n, x);
    }

    /// Copies of these entries more.
    #[inline]
    pub fn extend_from_slice(&mut self, entries: &[T]) {
        self.reserve(entries.len());
        self.0.extend_from_slice(entries);
    }

    /// The entries of the parts, one part after the other.
    pub fn concat(parts: &[&[T]]) -> Self {
        let mut list = Self::with_capacity(parts.iter().map(|part| part.len()).sum());
        parts.iter().for_each(|part| list.extend_from_slice(part));
        list
    }
}

impl<T: 'static> Drop for List<T> {
    #[inline]
    fn drop(&mut self) {
        if self.0.capacity() > 0 {
            give_back(std::mem::take(&mut self.0));
        }
    }
}

impl<T: 'static> Default for List<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Clone + 'static> Clone for List<T> {
    fn clone(&self) -> Self {
        Self::from(&self.0[..])
    }
    fn clone_from(&mut self, source: &Self) {
        self.0.clear();
        self.extend_from_slice(source);
    }
}

impl<T: 'static> Deref for List<T> {
    type Target = Vec<T>;
    #[inline]
    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T: 'static> DerefMut for List<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}

impl<T: 'static> AsRef<[T]> for List<T> {
    fn as_ref(&self) -> &[T] {
        &self.0
    }
}

impl<T: 'static> From<Vec<T>> for List<T> {
    fn from(entries: Vec<T>) -> Self {
        Self(entries)
    }
}

impl<T: Clone + 'static> From<&[T]> for List<T> {
    fn from(entries: &[T]) -> Self {
        let mut list = Self::with_capacity(entries.len());
        list.extend_from_slice(entries);
        list
    }
}

impl<T: 'static, const N: usize> From<[T; N]> for List<T> {
    fn from(entries: [T; N]) -> Self {
        entries.into_iter().collect()
    }
}

impl<T: 'static> FromIterator<T> for List<T> {
    fn from_iter<I: IntoIterator<Item = T>>(entries: I) -> Self {
        let mut list = Self::new();
        list.extend(entries);
        list
    }
}

/// The memory goes to the allocator: where that matters, iterate over the list by reference.
impl<T: 'static> IntoIterator for List<T> {
    type Item = T;
    type IntoIter = std::vec::IntoIter<T>;
    fn into_iter(self) -> Self::IntoIter {
        self.into_vec().into_iter()
    }
}

impl<'a, T: 'static> IntoIterator for &'a List<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;
    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<'a, T: 'static> IntoIterator for &'a mut List<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;
    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter_mut()
    }
}

impl<T: PartialEq + 'static, U: AsRef<[T]> + ?Sized> PartialEq<U> for List<T> {
    fn eq(&self, other: &U) -> bool {
        self.0 == other.as_ref()
    }
}

impl<T: PartialEq + 'static> PartialEq<List<T>> for Vec<T> {
    fn eq(&self, other: &List<T>) -> bool {
        *self == other.0
    }
}

impl<T: PartialEq + 'static> PartialEq<List<T>> for [T] {
    fn eq(&self, other: &List<T>) -> bool {
        *self == other.0[..]
    }
}

impl<T: PartialEq + 'static, const N: usize> PartialEq<List<T>> for [T; N] {
    fn eq(&self, other: &List<T>) -> bool {
        self[..] == other.0[..]
    }
}

impl<T: fmt::Debug + 'static> fmt::Debug for List<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<T: serde::Serialize + 'static> serde::Serialize for List<T> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de, T: serde::Deserialize<'de> + 'static> serde::Deserialize<'de> for List<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self)
    }
}

/// Lists of room for 2^k entries, for each k.
struct Shelf<T>([Vec<Vec<T>>; CLASSES]);

impl<T> Shelf<T> {
    const fn new() -> Self {
        Self([const { Vec::new() }; CLASSES])
    }
}

/// What a thread keeps. The types that nearly all lists are of are found without a search.
struct Shelves {
    numbers: Shelf<f64>,
    indices: Shelf<usize>,
    sides: Shelf<Interval>,
    others: Vec<(TypeId, Box<dyn Any>)>,
}

thread_local! {
    static SHELVES: RefCell<Shelves> = const {
        RefCell::new(Shelves {
            numbers: Shelf::new(),
            indices: Shelf::new(),
            sides: Shelf::new(),
            others: Vec::new(),
        })
    };
}

impl Shelves {
    #[inline(always)]
    fn shelf<T: 'static>(&mut self) -> Option<&mut Shelf<T>> {
        let id = TypeId::of::<T>();
        let shelf: &mut dyn Any = if id == TypeId::of::<f64>() {
            &mut self.numbers
        } else if id == TypeId::of::<usize>() {
            &mut self.indices
        } else if id == TypeId::of::<Interval>() {
            &mut self.sides
        } else {
            let at = self.others.iter().position(|(of, _)| *of == id);
            let at = at.unwrap_or_else(|| {
                self.others.push((id, Box::new(Shelf::<T>::new())));
                self.others.len() - 1
            });
            &mut *self.others[at].1
        };
        shelf.downcast_mut()
    }
}

// What follows is inlined always: called, it costs the smallest lists more than the allocator would.

/// An empty `Vec` with room for `capacity`.
#[inline(always)]
fn taken<T: 'static>(capacity: usize) -> Vec<T> {
    if capacity == 0 || size_of::<T>() == 0 {
        return Vec::new();
    }
    let class = usize::BITS - (capacity - 1).leading_zeros();
    let class = class.max(SMALLEST);
    let kept = with_shelves(|shelves| shelves.shelf::<T>()?.0.get_mut(class as usize)?.pop());
    kept.flatten().unwrap_or_else(|| {
        let kept_later = (class as usize) < CLASSES && size_of::<T>() <= MOST >> class;
        Vec::with_capacity(if kept_later { 1 << class } else { capacity })
    })
}

/// Keeps the memory of `entries` for the next list, or frees it where enough is kept.
#[inline(always)]
fn give_back<T: 'static>(mut entries: Vec<T>) {
    // Before the shelves are borrowed: entries may be lists.
    entries.clear();
    let capacity = entries.capacity();
    // A `Vec` of another capacity would be counted, and taken, as a shorter one.
    if capacity >> SMALLEST == 0 || !capacity.is_power_of_two() || size_of::<T>() == 0 {
        return;
    }
    let class = capacity.ilog2();
    with_shelves(|shelves| {
        if let Some(shelf) = shelves.shelf::<T>()
            && let Some(kept) = shelf.0.get_mut(class as usize)
            && kept.len() < (MOST / size_of::<T>()) >> class
        {
            kept.push(entries);
        }
    });
}

/// `None` while the thread ends and its shelves are gone.
#[inline(always)]
fn with_shelves<R>(f: impl FnOnce(&mut Shelves) -> R) -> Option<R> {
    SHELVES
        .try_with(|shelves| Some(f(&mut *shelves.try_borrow_mut().ok()?)))
        .ok()
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a thread of its own, whose shelves are empty.
    fn alone(test: impl FnOnce() + Send + 'static) {
        std::thread::spawn(test).join().unwrap();
    }

    /// How many lists of room for 2^`class` entries are kept.
    fn kept<T: 'static>(class: usize) -> usize {
        with_shelves(|shelves| shelves.shelf::<T>().map_or(0, |shelf| shelf.0[class].len()))
            .unwrap()
    }

    #[test]
    fn memory_of_a_dropped_list_is_that_of_the_next_of_its_size() {
        alone(|| {
            let first = List::filled(1.0, 100);
            let at = first.as_ptr();
            drop(first);
            assert_eq!(kept::<f64>(7), 1);
            assert_ne!(List::filled(1_u64, 100).as_ptr().cast(), at, "another type");
            let mut second: List<f64> = (0..65).map(f64::from).collect();
            assert_eq!((second.as_ptr(), kept::<f64>(7)), (at, 0));
            assert_eq!(second[64], 64.0);
            second.extend((0..64).map(f64::from));
            assert_eq!((second.len(), second[64], second[128]), (129, 64.0, 63.0));
            assert_eq!((second.capacity(), kept::<f64>(7)), (256, 1));
        });
    }

    /// Three times 1 MiB an entry: no power of two of them is kept, and no more is asked for than is needed.
    #[test]
    fn room_is_rounded_up_only_where_it_is_kept() {
        assert_eq!(List::<[u8; 3 << 20]>::with_capacity(1).capacity(), 1);
        assert_eq!(List::<[u8; 24]>::with_capacity(174_762).capacity(), 174_762);
        let few: List<u128> = (0..65_536_u128).filter(|x| *x == 5).collect();
        assert!(few.len() == 1 && few.capacity() < 100, "{}", few.capacity());
        let caught = std::panic::catch_unwind(|| List::<f64>::with_capacity(usize::MAX));
        assert!(caught.is_err());
    }

    #[test]
    fn lists_of_lists_give_back_both() {
        alone(|| {
            let rows: List<List<f64>> = (0..3).map(|_| List::filled(0.0, 9)).collect();
            drop(rows);
            assert_eq!((kept::<f64>(4), kept::<List<f64>>(2)), (3, 1));
        });
    }

    #[test]
    fn no_more_than_the_limit_is_kept() {
        alone(|| {
            let many: Vec<List<f64>> = (0..10).map(|_| List::filled(0.0, 1 << 17)).collect();
            drop(many);
            assert_eq!(kept::<f64>(17), MOST >> 20);
            drop(List::filled(0.0, MOST));
            // Its own size would look for it among the longer ones.
            drop(List::from(Vec::<f64>::with_capacity(600)));
            drop(List::filled(0.0, 600_000));
            assert_eq!((kept::<f64>(9), kept::<f64>(19)), (0, 0));
            drop(List::filled(0_u8, 3));
            assert_eq!((kept::<f64>(22), kept::<u8>(2)), (0, 1));
        });
    }

    #[test]
    fn a_list_is_read_and_written_as_its_entries() {
        let mut list = List::from([1.0, 2.5]);
        assert_eq!(serde_json::to_string(&list).unwrap(), "[1.0,2.5]");
        assert_eq!(serde_json::from_str::<List<f64>>("[1, 2.5]").unwrap(), list);
        assert_eq!(List::concat(&[&[1.0], &[2.5]]), list);
        assert_eq!(format!("{list:?}"), "[1.0, 2.5]");
        assert_eq!(
            list.iter().zip(&list).map(|(a, b)| a * b).sum::<f64>(),
            7.25
        );
        let short = List::from(vec![7.0]);
        list.clone_from(&short);
        assert_eq!(
            (list.len(), [7.0] == list, vec![7.0] == list),
            (1, true, true)
        );
        for x in &mut list {
            *x += 1.0;
        }
        assert_eq!(list.into_iter().collect::<Vec<f64>>(), [8.0]);
    }
}
