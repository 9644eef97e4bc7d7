//! The next event of every contact on a panel, and the queue that orders these events.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::contact::event_kind::EventKind;
use crate::transient::search::panel::Limit;
use crate::transient::trajectory::events::Grazing;

/// Largest distance, in panels, of two zeros that count as one because of their errors.
pub(super) const COINCIDENT: f64 = 1e-6;

/// The next event of a contact on a panel; times count from the start of the panel, s.
#[derive(Debug, Clone, Default)]
pub(super) struct Next {
    /// Number of the search that found it; older entries of the queue have another number.
    number: u32,
    /// Time from which on the zero is within its error.
    early: f64,
    pub triggers: [Option<EventKind>; 2],
    /// The limit of bounces that it is, at an accumulation.
    pub limit: Option<Limit>,
    pub touches: Vec<Grazing>,
}

/// An entry of the queue: an event of a contact, or one of its touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub at: f64,
    pub contact: usize,
    number: u32,
    touch: Option<usize>,
}

impl Eq for Entry {}

impl Ord for Entry {
    /// The earliest is the greatest; a touch comes before an event.
    fn cmp(&self, other: &Self) -> Ordering {
        let rank = |entry: &Self| (entry.contact, entry.touch.unwrap_or(usize::MAX));
        other.at.total_cmp(&self.at).then_with(|| rank(other).cmp(&rank(self)))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The next events of all contacts.
pub(super) struct NextEvents {
    by_contact: Vec<Next>,
    queue: BinaryHeap<Entry>,
}

impl NextEvents {
    pub fn new(contacts: usize) -> Self {
        Self { by_contact: vec![Next::default(); contacts], queue: BinaryHeap::new() }
    }

    /// Number of contacts.
    pub fn contacts(&self) -> usize {
        self.by_contact.len()
    }

    /// Forgets the events of the panel before.
    pub fn begin_panel(&mut self) {
        self.queue.clear();
    }

    /// The next event of a contact, to be filled by a new search; [`Self::enqueue`] follows.
    pub fn searched(&mut self, contact: usize) -> &mut Next {
        let next = &mut self.by_contact[contact];
        next.number = next.number.wrapping_add(1);
        next.triggers = [None; 2];
        next.limit = None;
        next.touches.clear();
        next
    }

    /// Puts the touches of a contact into the queue, and its event: the time, and that from which on it is within its error.
    pub fn enqueue(&mut self, contact: usize, event: Option<(f64, f64)>) {
        let next = &mut self.by_contact[contact];
        let number = next.number;
        for (index, touch) in next.touches.iter().enumerate() {
            self.queue.push(Entry { at: touch.time, contact, number, touch: Some(index) });
        }
        if let Some((at, early)) = event {
            next.early = early;
            self.queue.push(Entry { at, contact, number, touch: None });
        }
    }

    /// Takes the earliest entry, if it is not later than a time.
    pub fn pop(&mut self, horizon: f64) -> Option<Entry> {
        loop {
            let entry = self.queue.pop().filter(|entry| entry.at <= horizon)?;
            if self.is_current(&entry) {
                return Some(entry);
            }
        }
    }

    /// The touch of an entry; None for an event.
    pub fn touch(&self, entry: &Entry) -> Option<Grazing> {
        entry.touch.map(|index| self.by_contact[entry.contact].touches[index])
    }

    /// Takes the events that cannot be told from one by their errors; the contacts of all of them, ascending.
    pub fn coincident(&mut self, entry: &Entry, width: f64) -> Vec<usize> {
        let at = entry.at;
        let mut struck = vec![entry.contact];
        let mut later = Vec::new();
        while let Some(&other) = self.queue.peek()
            && other.at - at <= COINCIDENT * width
        {
            self.queue.pop();
            if !self.is_current(&other) {
                continue;
            }
            if other.touch.is_none() && self.by_contact[other.contact].early <= at {
                struck.push(other.contact);
            } else {
                later.push(other);
            }
        }
        self.queue.extend(later);
        struck.sort_unstable();
        struck
    }

    /// What triggers the next events of some contacts.
    pub fn triggers(&self, contacts: &[usize]) -> Vec<(usize, EventKind)> {
        let of = |&contact: &usize| {
            self.by_contact[contact].triggers.into_iter().flatten().map(move |kind| (contact, kind))
        };
        contacts.iter().flat_map(of).collect()
    }

    /// The limit of bounces that the next event of a contact is, if it is one.
    pub fn limit(&self, contact: usize) -> Option<Limit> {
        self.by_contact[contact].limit
    }

    fn is_current(&self, entry: &Entry) -> bool {
        self.by_contact[entry.contact].number == entry.number
    }
}
