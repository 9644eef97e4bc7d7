//! Many scenes at once, one per processor; each result is that of its scene alone.

use std::sync::Arc;

use rayon::prelude::*;

use crate::cycles::attractors::attractor::{Attractor, settle};
use crate::cycles::attractors::search::SearchLimits;
use crate::error::run::RunFailure;
use crate::linalg::parallel::in_parallel;
use crate::motion::propagators::Propagators;
use crate::scene::model::State;
use crate::transient::trajectory::events::StopReason;
use crate::transient::trajectory::model::Trajectory;

/// An attractor, with the last stretch of the motion towards it.
pub type Found = (Attractor, Trajectory);

/// The attractor of the motion from every start, in the order given; None for those that an interrupt prevented.
pub fn settle_all(
    cases: &[(Arc<Propagators>, State)],
    search: SearchLimits<'_>,
) -> Vec<Option<Result<Found, RunFailure>>> {
    let one = |(scene, start): &(Arc<Propagators>, State)| {
        if search.is_cancelled() {
            return None;
        }
        let found = RunFailure::guarded(|| settle(scene, start, search));
        let found = found.and_then(|found| Ok(found?));
        let unfinished =
            matches!(&found, Ok((_, run)) if run.stop_reason == StopReason::Interrupted);
        (!unfinished).then_some(found)
    };
    in_parallel(|| cases.par_iter().with_max_len(1).map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::method::Method;
    use crate::transient::batch::tests::{defective, job, oscillator};

    #[test]
    fn a_panic_is_the_failure_of_its_own_search() {
        let (sound, broken) = (oscillator(20.0), defective());
        let start = job(&sound).start.expect("given");
        let cases = [&sound, &broken, &sound]
            .map(|scene| (Arc::new(Propagators::new(Arc::clone(scene))), start.clone()));
        let search = SearchLimits {
            stretch: 0.5,
            limit: 1.0,
            method: Method::Auto,
            cancel: None,
            deadline: None,
        };
        let settled = settle_all(&cases, search);
        assert!(matches!(settled[0], Some(Ok(_))) && matches!(settled[2], Some(Ok(_))));
        let Some(Err(failure)) = &settled[1] else { panic!("not a failure") };
        assert!(failure.to_string().starts_with("internal error: "), "{failure}");
    }
}
