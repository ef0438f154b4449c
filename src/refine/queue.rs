//! What to do next: tasks ordered by the drop of image error that a ray is expected to buy.

use crate::cache::topology::NodeId;
use crate::cache::vertex::VertexId;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Split a leaf.
    Split(NodeId),
    /// Sample a leaf where its one pixel sees it.
    SamplePixel(NodeId),
    /// Trace the lights that a vertex has put off.
    Settle(VertexId),
    /// Take as many points again in the penumbrae of a vertex.
    Double(VertexId),
    /// Take as many rays of indirect light again at a vertex.
    Gather(VertexId),
    /// Sample indirect light in the middles of a leaf of its mesh.
    Refine(NodeId),
}

/// A task with what it was worth when it was queued.
#[derive(Clone, Copy, Debug)]
pub struct Entry<T> {
    /// Expected drop of the image's square error a ray.
    pub key: f32,
    /// The task.
    pub task: T,
    /// Version of the node or vertex that the key was computed from.
    pub version: u32,
    /// Order of arrival: the tie-break that keeps runs alike.
    serial: u64,
}

/// A queue.
#[derive(Debug)]
pub struct Queue<T> {
    heap: BinaryHeap<Entry<T>>,
    serial: u64,
}

impl<T> Default for Queue<T> {
    fn default() -> Self {
        Self { heap: BinaryHeap::new(), serial: 0 }
    }
}

impl<T> Queue<T> {
    /// Drops everything.
    pub fn clear(&mut self) {
        self.heap.clear();
    }

    /// Adds a task; one that is worth nothing is not kept.
    pub fn push(&mut self, key: f32, task: T, version: u32) {
        if key > 0.0 {
            self.serial += 1;
            self.heap.push(Entry { key, task, version, serial: self.serial });
        }
    }

    /// Takes the task of the greatest key.
    pub fn pop(&mut self) -> Option<Entry<T>> {
        self.heap.pop()
    }

    /// The greatest key.
    #[must_use]
    pub fn peek(&self) -> Option<f32> {
        self.heap.peek().map(|e| e.key)
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.heap.is_empty()
    }
}

impl<T> PartialEq for Entry<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for Entry<T> {}

impl<T> PartialOrd for Entry<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Entry<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key).then(other.serial.cmp(&self.serial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_key_comes_first_and_equals_keep_their_order() {
        let mut queue = Queue::default();
        for (key, vertex) in [(1.0, 1), (3.0, 2), (0.0, 3), (3.0, 4), (f32::NAN, 5)] {
            queue.push(key, Task::Settle(VertexId(vertex)), 0);
        }
        let order: Vec<Task> = std::iter::from_fn(|| queue.pop()).map(|e| e.task).collect();
        assert_eq!(order, [2, 4, 1].map(|v| Task::Settle(VertexId(v))));
    }
}
