//! The stability verdict alone on the samples of a study, whether or not they slide steadily.

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::modes::growth::{ChainMatrices, Verdict};
use crate::scene::statics::margins::Steady;
use crate::scene::status::{Combination, Status};
use crate::study::family::{Chain, Template};
use crate::study::questions::Samples;

/// The verdict on every sample, in one combination or that of its own sliding, on all threads of the pool in use.
///
/// # Errors
///
/// The error of the first sample that has no verdict, with its number.
pub fn verdicts(
    samples: &Samples<'_>,
    combination: Option<&Combination>,
) -> Result<Vec<Verdict>, (usize, Error)> {
    let workspace = || match samples {
        Samples::Family(family, _) => (Some(family.template()), ChainMatrices::default()),
        Samples::Scenes(_) => (None, ChainMatrices::default()),
    };
    let verdict =
        |(template, matrices): &mut (Option<Template>, ChainMatrices), k: usize| match samples {
            Samples::Family(family, rows) => {
                let template = template.get_or_insert_with(|| family.template());
                let width = family.width();
                family.fill(template, &rows[k * width..(k + 1) * width]);
                of_template(template, combination, matrices)
            }
            Samples::Scenes(scenes) => Verdict::of_scene(&scenes[k], combination),
        };
    // A few microseconds per sample: a hundred of them outweigh handing the work over.
    let numbers = (0..samples.len()).into_par_iter().with_min_len(128);
    let found: Vec<_> = in_parallel(|| numbers.map_init(workspace, verdict).collect());
    found.into_iter().enumerate().map(|(k, one)| one.map_err(|error| (k, error))).collect()
}

fn of_template(
    template: &Template,
    combination: Option<&Combination>,
    matrices: &mut ChainMatrices,
) -> Result<Verdict, Error> {
    if let Template::Chain(chain) = template
        && chain.is_well_posed()
        && let Some(statuses) = sliding(chain, combination)
    {
        let (growth, margins) = chain.growth(&statuses, matrices);
        let driven = chain.contacts.iter().zip(&statuses).all(|(law, &status)| {
            Status::driven_by(law.slider_speed).is_some_and(|driven| driven == status)
        });
        let exists = driven && margins.iter().all(|&normal_force| normal_force >= 0.0);
        return Ok(Verdict { growth, steady: Steady { exists, margins } });
    }
    Verdict::of_scene(&*template.scene()?, combination)
}

/// The statuses of a combination in which all contacts slide, by default as their sliders drive them.
fn sliding(chain: &Chain, combination: Option<&Combination>) -> Option<Vec<Status>> {
    let Some(combination) = combination else { return chain.sliding_statuses() };
    let slides = |status: &Status| matches!(status, Status::Positive | Status::Negative);
    combination.statuses().iter().all(slides).then(|| combination.statuses().to_vec())
}
