//! The branches of the largest real parts alone: what a sweep of a large problem asks for.
//!
//! A branch whose largest real part over the given values is among the n largest is, where it takes that value, among
//! the n largest modes: following the first n modes of every value both ways finds it. Branches are continued by the
//! correlation of their vectors alone. An interval is halved until that is decisive for the followed modes, at most
//! [`HALVINGS`] times: a veering sharper than the mesh is crossed along the shape of the mode, where the mesh of all modes
//! would follow it round the bend.

use rayon::prelude::*;

use crate::error::Error;
use crate::locus::branches::{Link, Mesh, Node, regular_nodes};
use crate::locus::parameter_path::Path;

/// How often the interval between two given values is halved; what is not decided then counts as a meeting. The cost is
/// bounded: a large problem has dense modes that veer or meet everywhere.
const HALVINGS: usize = 2;
/// Of a member that is not followed.
const NOWHERE: usize = usize::MAX;

/// The mesh through `values` that continues all candidates for the `modes` branches of the largest real parts, and these
/// candidates as members of the first node. Its links lead nowhere for other members.
pub(crate) fn leading(
    path: &Path,
    values: &[f64],
    modes: usize,
) -> Result<(Mesh, Vec<usize>), Error> {
    let (nodes, crossings) = regular_nodes(path, values)?;
    let mut mesh = Following {
        followed: nodes.iter().map(|node| foremost(node, modes)).collect(),
        links: vec![None; nodes.len() - 1],
        halvings: vec![0; nodes.len() - 1],
        nodes,
    };
    while mesh.links.iter().any(Option::is_none) {
        mesh.join(path)?;
        mesh.spread();
    }
    let first = (0..mesh.followed[0].len()).filter(|&k| mesh.followed[0][k]).collect();
    let links = mesh.links.into_iter().flatten().collect();
    Ok((Mesh { nodes: mesh.nodes, links, crossings }, first))
}

/// Which members belong to the modes of the largest real parts, so many that they hold twice as many eigenvalues as
/// `modes`: a pair may part into two real ones on the way.
fn foremost(node: &Node, modes: usize) -> Vec<bool> {
    let members = node.members();
    let mut order: Vec<usize> = (0..node.modes.len()).collect();
    let real = |mode: usize| node.modes[mode].eigenvalue.re;
    order.sort_by(|&r, &s| real(s).total_cmp(&real(r)));
    let mut eigenvalues = 0;
    let mut chosen = vec![false; node.modes.len()];
    for mode in order {
        if eigenvalues >= 2 * modes {
            break;
        }
        chosen[mode] = true;
        eigenvalues += if node.modes[mode].is_real() { 1 } else { 2 };
    }
    members.iter().map(|member| chosen[member.mode]).collect()
}

struct Following {
    nodes: Vec<Node>,
    /// Whether each member of a node is followed, conjugates alike.
    followed: Vec<Vec<bool>>,
    /// None: still to be joined.
    links: Vec<Option<Link>>,
    /// How often each interval has been halved.
    halvings: Vec<usize>,
}

enum Joined {
    Link(Link),
    Divided(Node),
}

impl Following {
    /// Joins or divides every open interval.
    fn join(&mut self, path: &Path) -> Result<(), Error> {
        let open: Vec<usize> = (0..self.links.len()).filter(|&k| self.links[k].is_none()).collect();
        let joined =
            open.par_iter().map(|&k| self.interval(path, k)).collect::<Result<Vec<_>, Error>>()?;
        // From the last one on, so that the places of those before stay.
        for (&k, joined) in open.iter().zip(joined).rev() {
            match joined {
                Joined::Link(link) => self.links[k] = Some(link),
                Joined::Divided(node) => {
                    self.followed.insert(k + 1, vec![false; node.members().len()]);
                    self.nodes.insert(k + 1, node);
                    self.links.insert(k, None);
                    self.halvings[k] += 1;
                    self.halvings.insert(k, self.halvings[k]);
                }
            }
        }
        Ok(())
    }

    fn interval(&self, path: &Path, k: usize) -> Result<Joined, Error> {
        let (from, to) = (&self.nodes[k], &self.nodes[k + 1]);
        if let Some(next) = self.continued(k) {
            return Ok(Joined::Link(Link { next, meeting: false }));
        }
        if self.halvings[k] < HALVINGS
            && let Some(node) = Node::between(path, from, to)?
        {
            return Ok(Joined::Divided(node));
        }
        let next = from.nearest(to, |i, j| self.followed[k][i] || self.followed[k + 1][j]);
        Ok(Joined::Link(Link { next, meeting: true }))
    }

    /// The decisive continuation of the followed members at both ends of an interval.
    fn continued(&self, k: usize) -> Option<Vec<usize>> {
        let modes = |k: usize| -> Vec<usize> {
            let members = self.nodes[k].members().into_iter().zip(&self.followed[k]);
            let own = members.filter(|(member, followed)| **followed && !member.conjugate);
            own.map(|(member, _)| member.mode).collect()
        };
        let (from, to) = (&self.nodes[k], &self.nodes[k + 1]);
        let rows = modes(k);
        let mut next = vec![NOWHERE; from.modes.len()];
        let mut taken = vec![false; to.modes.len()];
        for (r, s) in rows.iter().zip(from.continued_modes(&rows, to).0?) {
            next[*r] = s;
            taken[s] = true;
        }
        let others: Vec<usize> = modes(k + 1).into_iter().filter(|&s| !taken[s]).collect();
        for (s, r) in others.iter().zip(to.continued_modes(&others, from).0?) {
            if next[r] != NOWHERE {
                return None;
            }
            next[r] = *s;
        }
        Some(from.members_of(to, &next))
    }

    /// Follows members on along all links, and opens those that don't lead on what is followed now.
    fn spread(&mut self) {
        for k in (0..self.links.len()).chain((0..self.links.len()).rev()) {
            let Some(link) = &self.links[k] else { continue };
            let (before, after) = self.followed.split_at_mut(k + 1);
            let (here, there) = (&mut before[k], &mut after[0]);
            for (i, &j) in link.next.iter().enumerate().filter(|(_, j)| **j != NOWHERE) {
                let either = here[i] || there[j];
                (here[i], there[j]) = (either, either);
            }
            for k in [k, k + 1] {
                let members = self.nodes[k].members();
                for i in (1..members.len()).filter(|&i| members[i].conjugate) {
                    let either = self.followed[k][i - 1] || self.followed[k][i];
                    (self.followed[k][i - 1], self.followed[k][i]) = (either, either);
                }
            }
        }
        for k in 0..self.links.len() {
            let leads = |link: &Link| {
                let mut reached = vec![false; self.followed[k + 1].len()];
                link.next.iter().filter(|j| **j != NOWHERE).for_each(|&j| reached[j] = true);
                let on = link.next.iter().zip(&self.followed[k]);
                let back = reached.iter().zip(&self.followed[k + 1]);
                on.into_iter().all(|(&j, &followed)| !followed || j != NOWHERE)
                    && back.into_iter().all(|(&reached, &followed)| !followed || reached)
            };
            self.links[k].take_if(|link| !leads(link));
        }
    }
}
