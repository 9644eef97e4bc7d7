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

/// Stands for the continuation of a member that is not continued.
pub(crate) const NOWHERE: usize = usize::MAX;

/// Two modes of a node, and the two of the next node that continue them.
pub(crate) type Pair = [[usize; 2]; 2];

/// Two neighbouring nodes joined: `next[k]` is the member of the second that continues member k of the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Link {
    pub next: Vec<usize>,
    /// Whether branches meet in the interval, so that the continuation is a convention.
    pub meeting: bool,
    /// Modes that are continued together, not each by itself.
    pub pairs: Vec<Pair>,
}

/// How to join two nodes, from their `depth`, the number of divisions below the given values, and whether the interval
/// between them can be divided; None if it is to be divided first.
pub(crate) type Join<'a> = &'a (dyn Fn([&Node; 2], usize, bool) -> Option<Link> + Sync);

/// A condition that an interval must satisfy beyond a safe continuation; otherwise it is halved as well.
pub(crate) type Demand<'a> = &'a (dyn Fn(&Node, &Node, &[usize]) -> bool + Sync);

/// The nodes at all `values`, those apart at which branches cross without meeting.
fn regular_nodes(path: WatchedPath<'_>, values: &[f64]) -> Result<(Vec<Node>, Vec<Node>), Error> {
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
    /// The mesh through all `values` (ascending, at least one) that continues every branch, and as many points between them
    /// as this needs.
    pub fn new(path: WatchedPath<'_>, values: &[f64], demand: Demand<'_>) -> Result<Self, Error> {
        // Of the path, so that a part of the values has the same mesh as all of them.
        let (lower, upper) = path.range();
        let resolution = RESOLUTION * (upper - lower);
        Self::joined(path, values, &|[from, to], _, divisible| {
            let (continued, correlations) = from.continued(to);
            let every: Vec<usize> = (0..from.modes.len()).collect();
            let next = continued.as_ref().map(|next| from.members_of(to, next));
            let safe = continued
                .as_ref()
                .is_some_and(|next| from.drifting(&every, to, next, &correlations).is_none());
            match next {
                Some(next) if safe && demand(from, to, &next) => {
                    Some(Link { next, ..Link::default() })
                }
                _ if divisible && to.value - from.value > resolution => None,
                // A crossing of modes whose coupling is lost in rounding.
                Some(next) => Some(Link { next, ..Link::default() }),
                None => {
                    let next = from.nearest(to, from.apart(), |_, _| true);
                    Some(Link { next, meeting: true, ..Link::default() })
                }
            }
        })
    }

    /// The mesh through all `values` (ascending, at least one) with nodes joined as `join` says.
    pub fn joined(path: WatchedPath<'_>, values: &[f64], join: Join<'_>) -> Result<Self, Error> {
        let (nodes, crossings) = regular_nodes(path, values)?;
        let part = |pair: &[Node]| Self::between(path, [&pair[0], &pair[1]], join);
        let parts: Vec<Mesh> =
            in_parallel(|| nodes.par_windows(2).map(part).collect::<Result<_, Error>>())?;
        let mut mesh = Mesh { crossings, ..Mesh::default() };
        let mut nodes = nodes.into_iter();
        mesh.nodes.extend(nodes.next());
        parts.into_iter().zip(nodes).for_each(|(part, node)| mesh.append(part, node));
        Ok(mesh)
    }

    /// What lies between two nodes, without these.
    pub fn between(path: WatchedPath<'_>, ends: [&Node; 2], join: Join<'_>) -> Result<Self, Error> {
        let mut part = Mesh::default();
        part.refine(path, ends, 0, join)?;
        Ok(part)
    }

    /// Adds what lies between the last node and another one, and that one.
    pub fn append(&mut self, part: Mesh, node: Node) {
        self.nodes.extend(part.nodes);
        self.links.extend(part.links);
        self.nodes.push(node);
    }

    fn refine(
        &mut self,
        path: WatchedPath<'_>,
        [from, to]: [&Node; 2],
        depth: usize,
        join: Join<'_>,
    ) -> Result<(), Error> {
        let link = join([from, to], depth, true);
        let division = match link {
            Some(_) => None,
            None => Node::between(path, from, to)?,
        };
        let Some(node) = division else {
            self.links.extend(link.or_else(|| join([from, to], depth, false)));
            return Ok(());
        };
        self.refine(path, [from, &node], depth + 1, join)?;
        let place = self.nodes.len();
        self.nodes.push(Node::default());
        let refined = self.refine(path, [&node, to], depth + 1, join);
        self.nodes[place] = node;
        refined
    }

    /// The modes of node k that are continued to the next node without a meeting, each with the mode that continues it.
    pub fn continued(&self, k: usize) -> Vec<(usize, usize)> {
        let Link { next, meeting, .. } = &self.links[k];
        let (here, there) = (self.nodes[k].members(), self.nodes[k + 1].members());
        let joined = here.iter().zip(next);
        joined
            .filter(|&(member, &next)| !meeting && !member.conjugate && next != NOWHERE)
            .map(|(member, &next)| (member.mode, there[next].mode))
            .collect()
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
