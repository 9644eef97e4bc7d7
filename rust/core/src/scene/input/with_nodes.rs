//! Dofs without mass: the nodes of compliant contacts become such dofs, and forces that depend on their rates are refused.

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::input::scene_input::Damping;
use crate::scene::input::validated::Validated;
use crate::scene::massless::coordinates::{Nodes, condensed_stiffness};

/// The scene with the node of every compliant contact as a further dof, which springs tie to the others.
pub(crate) fn with_nodes(stated: Validated) -> Result<(Nodes, Validated), Error> {
    let dofs = stated.force.len();
    let nodes = Nodes::new(dofs, &stated.contacts);
    let massless = (0..dofs).any(|dof| stated.lacks_mass(dof));
    let damping = match stated.damping {
        Damping::Proportional { mass: alpha, stiffness: beta }
            if beta != 0.0 && (massless || !nodes.is_empty()) =>
        {
            let felt = condensed_stiffness(&stated.mass, &stated.stiffness)?;
            Damping::General(stated.mass.combined(alpha, &felt, beta))
        }
        damping => damping,
    };
    let stated = Validated { damping, ..stated };
    if massless {
        check_rates(&stated)?;
    }
    let mut force = stated.force;
    force.resize(nodes.size, 0.0);
    let padded = |matrix: SparseMatrix| matrix.padded(nodes.size);
    let whole = Validated {
        mass: padded(stated.mass),
        stiffness: nodes.with_springs(stated.stiffness),
        damping: match stated.damping {
            Damping::General(damping) => Damping::General(padded(damping)),
            proportional => proportional,
        },
        gyroscopic: stated.gyroscopic.map(padded),
        circulatory: stated.circulatory.map(padded),
        force,
        contacts: nodes.contacts(&stated.contacts),
        ..stated
    };
    Ok((nodes, whole))
}

/// Refuses damping, gyroscopic and circulatory forces on dofs without mass, whose motion follows from forces alone.
fn check_rates(stated: &Validated) -> Result<(), Error> {
    let given = match &stated.damping {
        Damping::General(damping) => Some(damping),
        Damping::Proportional { .. } => None,
    };
    let matrices = [
        ("damping", given),
        ("gyroscopic", stated.gyroscopic.as_ref()),
        ("circulatory", stated.circulatory.as_ref()),
    ];
    for (argument, matrix) in matrices {
        let Some(matrix) = matrix else { continue };
        for row in 0..matrix.size() {
            for (column, _) in matrix.row(row).filter(|entry| entry.1 != 0.0) {
                if let Some(dof) = [row, column].into_iter().find(|&dof| stated.lacks_mass(dof)) {
                    return Err(Error::RateWithoutMass { argument, dof });
                }
            }
        }
    }
    Ok(())
}
