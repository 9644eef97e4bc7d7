//! Eigenvalues along a parameter as continuous branches.
//!
//! An interval is halved until the correlation of the modes at its ends is decisive *and* no pair of coupled eigenvalues
//! has approached or left each other by more than half its distance: a veering, however sharp, is followed and not
//! jumped across.
//! At an exceptional point of a real parameter two branches meet and no continuation exists; there the interval shrinks
//! to [`RESOLUTION`], and the nearest eigenvalues are joined.

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::locus::node::Node;
use crate::locus::watched_path::WatchedPath;

/// Smallest interval, of the whole range; below it two branches count as meeting. Rounding splits a meeting pair by
/// the square root of an ulp, so nothing finer could be told from rounding.
pub(crate) const RESOLUTION: f64 = 1e-13;

/// Two neighbouring nodes joined: `next[k]` is the member of the second that continues member k of the first.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub next: Vec<usize>,
    /// Whether branches meet in the interval, so that the continuation is a convention.
    pub meeting: bool,
}

/// A condition that an interval must satisfy beyond a safe continuation; otherwise it is halved as well.
pub(crate) type Demand<'a> = &'a (dyn Fn(&Node, &Node, &[usize]) -> bool + Sync);

/// The nodes at all `values`, those apart at which branches cross without meeting.
pub(crate) fn regular_nodes(
    path: WatchedPath<'_>,
    values: &[f64],
) -> Result<(Vec<Node>, Vec<Node>), Error> {
    let nodes = in_parallel(|| {
        values.par_iter().map(|&value| Node::new(path, value)).collect::<Result<Vec<_>, _>>()
    })?;
    let crosses = |k: usize| {
        let neighbours = [nodes.get(k.wrapping_sub(1)), nodes.get(k + 1)];
        nodes[k].has_twins()
            && neighbours.iter().all(|node| node.is_some_and(|node| !node.has_twins()))
    };
    let crosses: Vec<bool> = (0..nodes.len()).map(crosses).collect();
    let (mut crossings, mut regular) = (Vec::new(), Vec::with_capacity(nodes.len()));
    for (node, crosses) in nodes.into_iter().zip(crosses) {
        if crosses { crossings.push(node) } else { regular.push(node) }
    }
    Ok((regular, crossings))
}

/// Nodes in ascending order of the parameter, each joined to the next.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub nodes: Vec<Node>,
    pub links: Vec<Link>,
    /// Points at which branches cross without meeting: their vectors there tell nothing, and the branches are joined
    /// past them.
    pub crossings: Vec<Node>,
}

impl Mesh {
    /// The mesh through all `values` (ascending, at least one) and as many points between them as are needed.
    pub fn new(path: WatchedPath<'_>, values: &[f64], demand: Demand<'_>) -> Result<Self, Error> {
        let (nodes, crossings) = regular_nodes(path, values)?;
        // Of the path, so that a part of the values has the same mesh as all of them.
        let (lower, upper) = path.range();
        let resolution = RESOLUTION * (upper - lower);
        let part = |pair: &[Node]| {
            let mut part = Mesh::default();
            part.refine(path, &pair[0], &pair[1], demand, resolution)?;
            Ok(part)
        };
        let parts = in_parallel(|| nodes.par_windows(2).map(part).collect::<Result<_, Error>>())?;
        Ok(Mesh { crossings, ..Mesh::joined(nodes, parts) })
    }

    /// The nodes with the parts between each two of them.
    pub fn joined(nodes: Vec<Node>, parts: Vec<Mesh>) -> Self {
        let mut mesh = Mesh::default();
        let mut nodes = nodes.into_iter();
        mesh.nodes.extend(nodes.next());
        for (part, node) in parts.into_iter().zip(nodes) {
            mesh.nodes.extend(part.nodes);
            mesh.links.extend(part.links);
            mesh.nodes.push(node);
        }
        mesh
    }

    fn refine(
        &mut self,
        path: WatchedPath<'_>,
        from: &Node,
        to: &Node,
        demand: Demand<'_>,
        resolution: f64,
    ) -> Result<(), Error> {
        let (continued, correlations) = from.continued(to);
        let every: Vec<usize> = (0..from.modes.len()).collect();
        if let Some(next) = &continued
            && from.keeps_distances(&every, to, next, &correlations)
        {
            let next = from.members_of(to, next);
            if demand(from, to, &next) {
                self.links.push(Link { next, meeting: false });
                return Ok(());
            }
        }
        if to.value - from.value > resolution
            && let Some(node) = Node::between(path, from, to)?
        {
            self.refine(path, from, &node, demand, resolution)?;
            let place = self.nodes.len();
            self.nodes.push(Node::default());
            let refined = self.refine(path, &node, to, demand, resolution);
            self.nodes[place] = node;
            return refined;
        }
        let link = match continued {
            // A crossing of modes whose coupling is lost in rounding.
            Some(next) => Link { next: from.members_of(to, &next), meeting: false },
            None => Link { next: from.nearest(to, from.apart(), |_, _| true), meeting: true },
        };
        self.links.push(link);
        Ok(())
    }

    /// For every node, the member that carries each branch; branches are the members of the first node.
    pub fn carriers(&self) -> Vec<Vec<usize>> {
        let count = self.nodes.first().map_or(0, |node| node.members().len());
        let mut current: Vec<usize> = (0..count).collect();
        let mut carriers = vec![current.clone()];
        for link in &self.links {
            current = current.iter().map(|&k| link.next[k]).collect();
            carriers.push(current.clone());
        }
        carriers
    }
}
