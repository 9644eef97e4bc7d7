//! The stability verdict alone on the samples of a study, whether or not they slide steadily.

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::modes::growth::{ChainMatrices, Verdict};
use crate::scene::status::Combination;
use crate::study::family::Template;
use crate::study::questions::{Samples, Workspace};

/// The verdict on every sample, in one combination or that of its own sliding, on all threads of the pool in use.
///
/// # Errors
///
/// The error of the first sample that has no verdict, with its number.
pub fn verdicts(
    samples: &Samples<'_>,
    combination: Option<&Combination>,
) -> Result<Vec<Verdict>, (usize, Error)> {
    let verdict = |workspace: &mut Workspace, k: usize| match samples {
        Samples::Family(family, rows) => {
            of_template(workspace.filled(family, rows, k), combination)
        }
        Samples::Scenes(scenes) => Verdict::of_scene(&scenes[k], combination),
    };
    // A few microseconds per sample: a hundred of them outweigh handing the work over.
    let numbers = (0..samples.len()).into_par_iter().with_min_len(128);
    let found: Vec<_> = in_parallel(|| numbers.map_init(Workspace::default, verdict).collect());
    found.into_iter().enumerate().map(|(k, one)| one.map_err(|error| (k, error))).collect()
}

fn of_template(
    (template, matrices): (&Template, &mut ChainMatrices),
    combination: Option<&Combination>,
) -> Result<Verdict, Error> {
    if let Template::Chain(chain) = template
        && let Some(verdict) = chain.verdict(combination, matrices)
    {
        return Ok(verdict);
    }
    Verdict::of_scene(&*template.scene()?, combination)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::chain::{Link, Subsystem};
    use crate::scene::contact_law::{ContactInput, Direction};
    use crate::study::family::{Chain, Family};
    use crate::study::fields::{Field, Slot};

    /// A chain of two subsystems on one slider.
    fn chain() -> Chain {
        let part = |mass, inclination, vertical, horizontal, ceiling| Subsystem {
            upper_mass: mass,
            contact_mass: mass,
            inclination,
            vertical_stiffness: vertical,
            horizontal_stiffness: horizontal,
            ceiling_stiffness: ceiling,
            preload_displacement: 1e-3,
            external_force: 0.0,
        };
        let contact = |part: usize| ContactInput {
            tangential: Some(Direction::Dof(4 * part + 2)),
            normal: Some(Direction::Dof(4 * part + 3)),
            friction: 0.3,
            static_friction: 0.3,
            slider_speed: 0.05,
            ..Default::default()
        };
        Chain {
            subsystems: vec![part(0.3, 0.3, 4.5e5, 3e5, 6e4), part(0.7, 0.75, 3e4, 2.4e6, 1.8e5)],
            links: vec![Link { horizontal_stiffness: 1.5e6, vertical_stiffness: 2.4e5 }],
            wall_stiffness: 1.8e6,
            damping: 1e-4,
            contacts: vec![contact(0), contact(1)],
            impact_friction: false,
        }
    }

    proptest::proptest! {
        /// The chain's own path answers as the scene of the same numbers does.
        #[test]
        fn verdicts_on_chains_are_those_on_their_scenes(
            friction in 0.0f64..2.5, inclination in 0.1f64..0.9, mass in 0.1f64..1.0,
            stiffness in 1e4f64..1e6, slider_speed in proptest::sample::select(vec![-0.1, 0.1]),
        ) {
            let fields = [
                (Field::Friction, friction), (Field::Inclination, inclination),
                (Field::ContactMass, mass), (Field::VerticalStiffness, stiffness),
                (Field::SliderSpeed, slider_speed),
            ];
            let slots = fields.map(|(field, _)| Slot { field, place: None }).to_vec();
            let family = Family::new(Template::Chain(chain()), slots, &[true, true]).unwrap();
            let row = fields.map(|(_, value)| value);
            let of_chain = verdicts(&Samples::Family(&family, &row), None).unwrap().remove(0);
            let mut template = family.template();
            family.fill(&mut template, &row);
            let of_scene = Verdict::of_scene(&template.scene().unwrap(), None).unwrap();
            proptest::prop_assert_eq!(of_chain.steady.exists, of_scene.steady.exists);
            for (own, general) in of_chain.steady.margins.iter().zip(&of_scene.steady.margins) {
                // Both solve for the same displacements, of condition up to some 1e4.
                proptest::prop_assert!((own - general).abs() <= 1e-10 * general.abs().max(1.0));
            }
            let (own, general) = (of_chain.growth, of_scene.growth);
            let distance = (own.eigenvalue - general.eigenvalue).norm();
            // Near a lock-in an eigenvalue moves by the square root of rounding.
            proptest::prop_assert!(distance <= 1e-6 * general.eigenvalue.norm());
            proptest::prop_assert!(own.unstable_modes == general.unstable_modes || distance > 0.0);
        }
    }

    #[test]
    fn a_slot_that_the_template_lacks_makes_no_family() {
        let family = |field: Field, place: Option<usize>| {
            Family::new(Template::Chain(chain()), vec![Slot { field, place }], &[true, true])
        };
        assert!(family(Field::UpperMass, Some(1)).is_some());
        assert!(family(Field::UpperMass, Some(2)).is_none());
        assert!(family(Field::WallStiffness, Some(0)).is_none());
        assert!(family(Field::HarmonicAmplitude, Some(0)).is_none());
        let scene = Template::Scene(Box::new(chain().input()));
        let slot = Slot { field: Field::UpperMass, place: None };
        assert!(Family::new(scene, vec![slot], &[true, true]).is_none());
    }
}
