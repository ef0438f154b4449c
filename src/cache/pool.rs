//! Index arena with a free list: what every structure of the cache is stored in.

/// Values addressed by recyclable 32-bit indices.
#[derive(Clone, Debug)]
pub struct Pool<T> {
    items: Vec<T>,
    free: Vec<u32>,
}

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self { items: Vec::new(), free: Vec::new() }
    }
}

impl<T> Pool<T> {
    /// Stores a value, in a freed place if there is one.
    pub fn insert(&mut self, value: T) -> u32 {
        if let Some(index) = self.free.pop() {
            self.items[index as usize] = value;
            return index;
        }
        self.items.push(value);
        (self.items.len() - 1) as u32
    }

    /// Gives a place back. Its value stays readable until it is reused.
    pub fn remove(&mut self, index: u32) {
        debug_assert!(!self.free.contains(&index), "index {index} freed twice");
        self.free.push(index);
    }

    /// One past the largest index handed out.
    #[must_use]
    pub fn end(&self) -> u32 {
        self.items.len() as u32
    }

    /// Number of live values.
    #[must_use]
    pub fn live(&self) -> usize {
        self.items.len() - self.free.len()
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.items.capacity() * size_of::<T>() + self.free.capacity() * 4
    }
}

impl<T> std::ops::Index<u32> for Pool<T> {
    type Output = T;
    fn index(&self, index: u32) -> &T {
        &self.items[index as usize]
    }
}

impl<T> std::ops::IndexMut<u32> for Pool<T> {
    fn index_mut(&mut self, index: u32) -> &mut T {
        &mut self.items[index as usize]
    }
}

/// Values at scattered indices, in pages that exist only where something was written.
#[derive(Clone, Debug)]
pub struct Sparse<T> {
    pages: Vec<Option<Box<[T; PAGE]>>>,
}

/// Values a page.
const PAGE: usize = 64;

impl<T> Default for Sparse<T> {
    fn default() -> Self {
        Self { pages: Vec::new() }
    }
}

impl<T: Default + Copy> Sparse<T> {
    /// The value at `index`, the default where none was written.
    #[must_use]
    pub fn get(&self, index: u32) -> T {
        match self.pages.get(index as usize / PAGE) {
            Some(Some(page)) => page[index as usize % PAGE],
            _ => T::default(),
        }
    }

    /// The value at `index`, to write.
    pub fn entry(&mut self, index: u32) -> &mut T {
        let page = index as usize / PAGE;
        if page >= self.pages.len() {
            self.pages.resize_with(page + 1, || None);
        }
        let page = self.pages[page].get_or_insert_with(|| Box::new([T::default(); PAGE]));
        &mut page[index as usize % PAGE]
    }

    /// Back to the default.
    pub fn reset(&mut self, index: u32) {
        if let Some(Some(page)) = self.pages.get_mut(index as usize / PAGE) {
            page[index as usize % PAGE] = T::default();
        }
    }

    /// Visits the values of all pages, with their indices: those written, and defaults beside them.
    pub fn for_each_mut(&mut self, mut visit: impl FnMut(u32, &mut T)) {
        for (page, first) in self.pages.iter_mut().zip((0..).step_by(PAGE)) {
            page.iter_mut()
                .flat_map(|page| page.iter_mut())
                .zip(first..)
                .for_each(|(value, index)| visit(index, value));
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let pages = self.pages.iter().flatten().count();
        self.pages.capacity() * size_of::<usize>() + pages * PAGE * size_of::<T>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn freed_places_are_reused_before_new_ones() {
        let mut pool = Pool::default();
        let (a, b) = (pool.insert('a'), pool.insert('b'));
        pool.remove(a);
        assert_eq!((pool.live(), pool.end()), (1, 2));
        assert_eq!(pool.insert('c'), a);
        assert_eq!((pool[a], pool[b], pool.end()), ('c', 'b', 2));
    }

    #[test]
    fn sparse_pages_exist_only_where_written() {
        let mut sparse = Sparse::<u32>::default();
        assert_eq!(sparse.get(1_000_000), 0);
        *sparse.entry(1_000_000) = 5;
        assert_eq!((sparse.get(1_000_000), sparse.get(999_999)), (5, 0));
        assert!(sparse.bytes() < 300_000);
    }
}
