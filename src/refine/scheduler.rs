//! What to do next: tasks ordered by the drop of the image's square error that a ray is expected to buy.
//!
//! Keys are brought up to date lazily. A task that has become worth less is found when it comes up, and put back; one
//! that has become worth more is pushed again, and what was queued for it before is void.

use super::bands::Bands;
use crate::cache::bytes::Places;
use crate::cache::ids::{NodeId, VertexId};
use crate::cache::pool::Table;
use std::collections::VecDeque;

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Split a leaf.
    Split(NodeId),
    /// Sample a leaf where its one pixel sees it.
    SamplePixel(NodeId),
    /// Trace the lights that a vertex has put off.
    TraceDeferred(VertexId),
    /// Take as many points again in the penumbrae of a vertex.
    DoublePoints(VertexId),
    /// Take as many rays of indirect light again at a vertex.
    Gather(VertexId),
    /// Sample indirect light in the middles of a leaf of the indirect layer.
    RefineIndirect(NodeId),
    /// Check each pixel of a leaf for mismatches.
    CheckPixels(NodeId),
}

/// Kinds of tasks.
const KINDS: u32 = 7;

impl Task {
    /// One number for each task.
    fn number(self) -> u32 {
        let (kind, id) = match self {
            Self::Split(id) => (0, id.0),
            Self::SamplePixel(id) => (1, id.0),
            Self::TraceDeferred(id) => (2, id.0),
            Self::DoublePoints(id) => (3, id.0),
            Self::Gather(id) => (4, id.0),
            Self::RefineIndirect(id) => (5, id.0),
            Self::CheckPixels(id) => (6, id.0),
        };
        debug_assert!(id <= (u32::MAX - kind) / KINDS, "600 million nodes take more memory than there is");
        id * KINDS + kind
    }

    const fn of_number(number: u32) -> Self {
        let id = number / KINDS;
        match number % KINDS {
            0 => Self::Split(NodeId(id)),
            1 => Self::SamplePixel(NodeId(id)),
            2 => Self::TraceDeferred(VertexId(id)),
            3 => Self::DoublePoints(VertexId(id)),
            4 => Self::Gather(VertexId(id)),
            5 => Self::RefineIndirect(NodeId(id)),
            _ => Self::CheckPixels(NodeId(id)),
        }
    }
}

/// A task with what it was worth when it was queued, in one word whose order is that of the queue: the bits of the key, which
/// order positive numbers, then of two tasks of one key the lower number first, which keeps runs alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    fn new(key: f32, task: Task) -> Self {
        Self(u64::from(key.to_bits()) << 32 | u64::from(!task.number()))
    }

    /// Expected drop of the image's square error a ray: pixels × (W·sr⁻¹·m⁻²)².
    const fn key(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    const fn task(self) -> Task {
        Task::of_number(!(self.0 as u32))
    }
}

/// Key that a task waits with; 0 if it does not. Entries of other keys are void.
type Ticket = f32;

/// The queue of everything that is worth doing.
#[derive(Debug, Default)]
pub struct Scheduler {
    /// Vertices that were never visited: before anything else, in this order.
    first_visits: VecDeque<VertexId>,
    heap: Bands<Entry>,
    /// The greatest of them, as long as they are judged ahead, in order, with what they are worth now.
    ahead: VecDeque<(Entry, Option<f32>)>,
    /// Pixel checks, whose keys count by a miss rate that is still being learnt.
    checks: Bands<Entry>,
    vertices: Table<VertexId, [Ticket; 3]>,
    nodes: Table<NodeId, [Ticket; 4]>,
}

/// Rise of a key that is worth another entry in the queue.
const RISEN: f32 = 1.25;

impl Scheduler {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let first_visits = self.first_visits.capacity() * size_of::<VertexId>();
        first_visits + self.heap.bytes() + self.checks.bytes() + self.vertices.bytes() + self.nodes.bytes()
    }

    /// Bytes that so many more places take.
    #[must_use]
    pub const fn bytes_of(added: &Places) -> usize {
        // With an entry in the queue each.
        added.nodes * size_of::<[Ticket; 6]>() + added.vertices * size_of::<[Ticket; 5]>()
    }

    /// Drops everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// First visits that wait.
    #[must_use]
    pub fn first_visits(&self) -> usize {
        self.first_visits.len()
    }

    /// Whether nothing waits, pixel checks included.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.has_only_checks() && self.checks.is_empty()
    }

    /// Whether nothing but pixel checks waits.
    #[must_use]
    pub fn has_only_checks(&self) -> bool {
        self.first_visits.is_empty() && self.heap.is_empty()
    }

    /// The greatest key that waits, first visits and pixel checks left out.
    pub fn greatest(&mut self) -> Option<f32> {
        self.drop_void();
        let entry = if self.next_is_ahead() { self.ahead.front().map(|(entry, _)| entry) } else { self.heap.peek() };
        entry.map(|entry| entry.key())
    }

    /// Drops what is void before the first that is not, ahead and in the heap.
    fn drop_void(&mut self) {
        while let Some(&(entry, _)) = self.ahead.front()
            && self.is_void(entry)
        {
            self.ahead.pop_front();
        }
        while let Some(&entry) = self.heap.peek()
            && self.is_void(entry)
        {
            self.heap.pop();
        }
    }

    fn is_void(&mut self, entry: Entry) -> bool {
        *self.ticket(entry.task()) != entry.key()
    }

    /// Whether the first that is taken next is ahead: others may have been queued since.
    fn next_is_ahead(&self) -> bool {
        self.ahead.front().is_some_and(|(entry, _)| self.heap.peek().is_none_or(|other| entry > other))
    }

    /// Whether tasks are judged ahead.
    #[must_use]
    pub fn has_judged(&self) -> bool {
        !self.ahead.is_empty()
    }

    /// The next tasks, so many, to be judged ahead of their turn.
    pub fn look_ahead(&mut self, count: usize) -> Vec<Task> {
        self.stop_judging();
        while self.ahead.len() < count
            && let Some(entry) = self.heap.pop()
        {
            if !self.is_void(entry) {
                self.ahead.push_back((entry, None));
            }
        }
        self.ahead.iter().map(|(entry, _)| entry.task()).collect()
    }

    /// Notes what these are worth now.
    pub fn note_judged(&mut self, keys: impl Iterator<Item = f32>) {
        self.ahead.iter_mut().zip(keys).for_each(|((_, judged), key)| *judged = Some(key));
    }

    /// Forgets what tasks were judged to be worth, since something has changed.
    pub fn stop_judging(&mut self) {
        self.ahead.drain(..).for_each(|(entry, _)| self.heap.push(entry.key(), entry));
    }

    /// The greatest key of a pixel check that waits, 0 without any.
    #[must_use]
    pub fn greatest_check(&self) -> f32 {
        self.checks.peek().map_or(0.0, |entry| entry.key())
    }

    /// Queues first visits in this order.
    pub fn push_first_visits(&mut self, vertices: impl Iterator<Item = VertexId>) {
        self.first_visits.extend(vertices);
    }

    /// Drops first visits of vertices that are gone.
    pub fn retain_first_visits(&mut self, is_there: impl Fn(VertexId) -> bool) {
        self.first_visits.retain(|&vertex| is_there(vertex));
    }

    /// Takes up to so many first visits.
    pub fn take_first_visits(&mut self, most: usize) -> Vec<VertexId> {
        let taken = self.first_visits.drain(..most.min(self.first_visits.len())).collect();
        if self.first_visits.is_empty() {
            // There are as many as vertices in a new view, and few after that.
            self.first_visits = VecDeque::new();
        }
        taken
    }

    /// Queues a task, in place of what is queued for it, unless that waits with about as high a key or a higher one;
    /// one that is worth nothing is not kept.
    pub fn offer(&mut self, task: Task, key: f32) {
        let ticket = self.ticket(task);
        if key > *ticket * RISEN {
            *ticket = key;
            let queue = if matches!(task, Task::CheckPixels(_)) { &mut self.checks } else { &mut self.heap };
            queue.push(key, Entry::new(key, task));
        }
    }

    /// Whether a task waits.
    pub fn waits(&mut self, task: Task) -> bool {
        *self.ticket(task) > 0.0
    }

    /// Makes what is queued for a task void.
    pub fn void(&mut self, task: Task) {
        *self.ticket(task) = 0.0;
    }

    /// Makes what is queued of direct light at a vertex void: its samples have changed.
    pub fn void_direct(&mut self, vertex: VertexId) {
        self.void(Task::TraceDeferred(vertex));
        self.void(Task::DoublePoints(vertex));
    }

    /// Takes the task of the greatest key, with that; pixel checks are left.
    pub fn pop(&mut self) -> Option<(Task, f32)> {
        self.pop_judged().map(|(task, key, _)| (task, key))
    }

    /// The same with what it is worth now, if it was judged ahead.
    pub fn pop_judged(&mut self) -> Option<(Task, f32, Option<f32>)> {
        self.drop_void();
        let next =
            if self.next_is_ahead() { self.ahead.pop_front() } else { self.heap.pop().map(|entry| (entry, None)) };
        let (entry, judged) = next?;
        self.void(entry.task());
        Some((entry.task(), entry.key(), judged))
    }

    /// Takes the pixel check of the greatest key.
    pub fn pop_check(&mut self) -> Option<NodeId> {
        while let Some(entry) = self.checks.pop() {
            if let Task::CheckPixels(id) = entry.task()
                && !self.is_void(entry)
            {
                self.void(entry.task());
                return Some(id);
            }
        }
        None
    }

    fn ticket(&mut self, task: Task) -> &mut Ticket {
        match task {
            Task::TraceDeferred(id) => &mut self.vertices[id][0],
            Task::DoublePoints(id) => &mut self.vertices[id][1],
            Task::Gather(id) => &mut self.vertices[id][2],
            Task::Split(id) => &mut self.nodes[id][0],
            Task::SamplePixel(id) => &mut self.nodes[id][1],
            Task::RefineIndirect(id) => &mut self.nodes[id][2],
            Task::CheckPixels(id) => &mut self.nodes[id][3],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(scheduler: &mut Scheduler) -> Vec<Task> {
        std::iter::from_fn(|| scheduler.pop()).map(|(task, _)| task).collect()
    }

    #[test]
    fn an_entry_tells_its_key_and_its_task() {
        for id in [0, 1, 77_777, 600_000_000] {
            let (node, vertex) = (NodeId(id), VertexId(id));
            let of_nodes =
                [Task::Split, Task::SamplePixel, Task::RefineIndirect, Task::CheckPixels].map(|task| task(node));
            let of_vertices = [Task::TraceDeferred, Task::DoublePoints, Task::Gather].map(|task| task(vertex));
            for task in of_nodes.into_iter().chain(of_vertices) {
                for key in [f32::from_bits(1), 1e-30, 0.3, 1e30, f32::INFINITY] {
                    let entry = Entry::new(key, task);
                    assert_eq!((entry.key(), entry.task()), (key, task));
                }
            }
        }
        let (low, high) = (Entry::new(0.5, Task::Split(NodeId(9))), Entry::new(2.0, Task::Split(NodeId(9))));
        assert!(low < high && high < Entry::new(2.0, Task::Split(NodeId(8))));
    }

    #[test]
    fn the_greatest_key_comes_first_and_of_equals_the_lower_number() {
        let mut scheduler = Scheduler::default();
        for (key, vertex) in [(1.0, 1), (3.0, 4), (0.0, 3), (3.0, 2), (f32::NAN, 5)] {
            scheduler.offer(Task::DoublePoints(VertexId(vertex)), key);
        }
        assert_eq!(all(&mut scheduler), [2, 4, 1].map(|v| Task::DoublePoints(VertexId(v))));
    }

    #[test]
    fn a_task_waits_once_and_is_raised_only_by_a_key_that_has_risen() {
        let mut scheduler = Scheduler::default();
        let (task, other) = (Task::Gather(VertexId(1)), Task::Gather(VertexId(2)));
        scheduler.offer(task, 4.0);
        scheduler.offer(other, 4.5);
        scheduler.offer(task, 4.9);
        assert_eq!(scheduler.greatest(), Some(4.5));
        scheduler.offer(task, 5.1);
        assert_eq!(all(&mut scheduler), [task, other]);
        scheduler.offer(task, 0.1);
        assert_eq!(all(&mut scheduler), [task], "what came up does not wait any more");
    }

    #[test]
    fn what_is_void_does_not_come_up() {
        let mut scheduler = Scheduler::default();
        let [a, b] = [1, 2].map(|v| Task::TraceDeferred(VertexId(v)));
        scheduler.offer(a, 5.0);
        scheduler.offer(Task::DoublePoints(VertexId(1)), 4.0);
        scheduler.offer(b, 3.0);
        scheduler.void_direct(VertexId(1));
        assert_eq!(scheduler.greatest(), Some(3.0));
        scheduler.offer(a, 1.0);
        assert_eq!(all(&mut scheduler), [b, a]);
    }

    #[test]
    fn what_is_judged_ahead_comes_in_its_turn() {
        let mut scheduler = Scheduler::default();
        let task = |v: u32| Task::Gather(VertexId(v));
        for v in 1..6 {
            scheduler.offer(task(v), v as f32);
        }
        assert_eq!(scheduler.look_ahead(3), [5, 4, 3].map(task));
        scheduler.note_judged([0.5, 0.4, 0.3].into_iter());
        assert_eq!(scheduler.pop_judged(), Some((task(5), 5.0, Some(0.5))));
        scheduler.offer(task(6), 3.5);
        scheduler.offer(task(7), 3.0);
        assert_eq!((scheduler.pop_judged(), scheduler.greatest()), (Some((task(4), 4.0, Some(0.4))), Some(3.5)));
        assert_eq!(scheduler.pop_judged(), Some((task(6), 3.5, None)), "queued since");
        scheduler.void(task(3));
        scheduler.offer(task(3), 2.5);
        scheduler.offer(task(2), 4.0);
        assert_eq!(scheduler.look_ahead(2), [2, 7].map(task));
        scheduler.stop_judging();
        assert!(!scheduler.has_judged() && !scheduler.is_empty());
        assert_eq!(all(&mut scheduler), [2, 7, 3, 1].map(task));
    }

    #[test]
    fn first_visits_come_before_everything_in_their_order() {
        let mut scheduler = Scheduler::default();
        scheduler.offer(Task::Split(NodeId(7)), 1e30);
        scheduler.push_first_visits([3, 1, 2].map(VertexId).into_iter());
        assert_eq!(scheduler.take_first_visits(2), [3, 1].map(VertexId));
        assert_eq!((scheduler.first_visits(), scheduler.take_first_visits(9)), (1, vec![VertexId(2)]));
        assert_eq!(scheduler.first_visits(), 0);
        assert_eq!(all(&mut scheduler), [Task::Split(NodeId(7))]);
    }

    #[test]
    fn what_was_cleared_is_void() {
        let mut scheduler = Scheduler::default();
        scheduler.offer(Task::CheckPixels(NodeId(1)), 2.0);
        scheduler.offer(Task::Gather(VertexId(1)), 2.0);
        assert_eq!((scheduler.greatest_check(), scheduler.has_only_checks()), (2.0, false));
        scheduler.clear();
        assert!(scheduler.is_empty() && !scheduler.waits(Task::CheckPixels(NodeId(1))));
        assert_eq!((all(&mut scheduler), scheduler.pop_check()), (Vec::new(), None));
        scheduler.offer(Task::Gather(VertexId(1)), 0.5);
        assert_eq!(all(&mut scheduler), [Task::Gather(VertexId(1))]);
    }
}
