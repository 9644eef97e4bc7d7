//! The samples of a study.

use std::sync::Arc;

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{matrix, method_named, vector};
use crate::errors::{named, raise};
use crate::interrupt::{detached, until_interrupted};
use crate::parameters::path::verdict_arrays;
use crate::scene::chain::ChainColumns;
use crate::scene::input::{ContactData, contact_inputs};
use crate::scene::model::Scene;
use crate::trajectory::Trajectory;

/// Field and place of every parameter.
type Slots = Vec<(String, Option<usize>)>;

#[pyclass(frozen, module = "stickslip._core")]
pub struct Family {
    inner: core::study::Family,
}

impl Family {
    fn build(
        py: Python<'_>,
        template: core::study::Template,
        slots: Slots,
        following: &[bool],
    ) -> PyResult<Self> {
        let unknown = |name: &str| {
            named(py, "InputError", &format!("{name}: the model has no such parameter to vary"))
        };
        let parsed = slots
            .iter()
            .map(|(name, place)| match core::study::Field::named(name) {
                Some(field) => Ok(core::study::Slot { field, place: *place }),
                None => Err(unknown(name)),
            })
            .collect::<PyResult<Vec<_>>>()?;
        let names: Vec<&str> = slots.iter().map(|slot| slot.0.as_str()).collect();
        core::study::Family::new(template, parsed, following)
            .map(|inner| Self { inner })
            .ok_or_else(|| unknown(&names.join(", ")))
    }
}

#[pymethods]
impl Family {
    /// The contact law of a scene; `following`: contacts whose static friction equals their friction.
    #[staticmethod]
    fn of_scene(
        py: Python<'_>,
        scene: &Scene,
        slots: Slots,
        following: Vec<bool>,
    ) -> PyResult<Self> {
        Self::build(
            py,
            core::study::Template::Scene(Box::new(scene.input.clone())),
            slots,
            &following,
        )
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "one argument per parameter of the model")]
    fn of_chain(
        py: Python<'_>,
        columns: ChainColumns<'_>,
        wall_stiffness: f64,
        damping: f64,
        contacts: Vec<ContactData<'_>>,
        impact_friction: bool,
        slots: Slots,
        following: Vec<bool>,
    ) -> PyResult<Self> {
        let (subsystems, links) = columns.parts(py)?;
        let chain = core::study::Chain {
            subsystems,
            links,
            wall_stiffness,
            damping,
            contacts: contact_inputs(&contacts).map_err(|error| raise(py, &error))?,
            impact_friction,
        };
        Self::build(py, core::study::Template::Chain(chain), slots, &following)
    }
}

/// duration, further, method, max_events, added (position, velocity), settle, energy, keep
#[derive(FromPyObject)]
pub struct MotionData<'py>(
    f64,
    f64,
    String,
    Option<usize>,
    Option<(PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>)>,
    bool,
    bool,
    bool,
);

#[derive(FromPyObject)]
pub enum SampleData<'py> {
    Family(PyRef<'py, Family>, PyReadonlyArray2<'py, f64>),
    Scenes(Vec<PyRef<'py, Scene>>),
}

impl SampleData<'_> {
    /// Rows of numbers, or scenes.
    fn taken(&self, py: Python<'_>) -> PyResult<(Vec<f64>, Vec<Arc<core::Scene>>)> {
        Ok(match self {
            SampleData::Family(_, table) => {
                (table.as_array().iter().copied().collect(), Vec::new())
            }
            SampleData::Scenes(listed) => {
                let scenes = listed.iter().map(|scene| scene.core(py).map(Arc::clone));
                (Vec::new(), scenes.collect::<PyResult<_>>()?)
            }
        })
    }

    fn source<'a>(
        &'a self,
        rows: &'a [f64],
        scenes: &'a [Arc<core::Scene>],
    ) -> core::study::Samples<'a> {
        match self {
            SampleData::Family(family, _) => core::study::Samples::Family(&family.inner, rows),
            SampleData::Scenes(_) => core::study::Samples::Scenes(scenes),
        }
    }
}

/// Columns of verdicts, or a sample that has none and why.
#[derive(IntoPyObject)]
pub enum Verdicts<'py> {
    Found(Bound<'py, PyDict>),
    Refused(usize, String),
}

/// The verdict on each sample, in one combination or that of its own sliding; all have as many contacts. What has none
/// is refused, by its number and the reason.
#[pyfunction]
pub fn verdicts<'py>(
    py: Python<'py>,
    samples: SampleData<'py>,
    contacts: usize,
    combination: Option<&str>,
) -> PyResult<Verdicts<'py>> {
    let combination = combination
        .map(|text| core::Combination::parse(text, contacts))
        .transpose()
        .map_err(|error| raise(py, &error))?;
    let (rows, scenes) = samples.taken(py)?;
    let source = samples.source(&rows, &scenes);
    match detached(py, || core::study::verdicts(&source, combination.as_ref()))? {
        Ok(found) => Ok(Verdicts::Found(verdict_arrays(py, found, combination.as_ref())?)),
        Err((sample, error)) => Ok(Verdicts::Refused(sample, error.to_string())),
    }
}

/// Columns of answers, one entry or row per sample; missing numbers are nan, missing counts -1.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "one argument per question")]
pub fn answers<'py>(
    py: Python<'py>,
    samples: SampleData<'py>,
    sizes: (usize, usize, usize),
    combination: Option<String>,
    growth: bool,
    eigenvalues: bool,
    normal_force: bool,
    hopf: Option<(Vec<usize>, f64, f64)>,
    motion: Option<MotionData<'py>>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let combination = combination
        .map(|text| core::Combination::parse(&text, sizes.1))
        .transpose()
        .map_err(|error| raise(py, &error))?;
    let motion = match motion {
        Some(MotionData(duration, further, method, max_events, added, settle, energy, keep)) => {
            Some(core::study::MotionQuestions {
                duration,
                further,
                method: method_named(py, &method)?,
                max_events,
                added: added.map(|(position, velocity)| (vector(&position), vector(&velocity))),
                settle,
                energy,
                keep,
            })
        }
        None => None,
    };
    let questions = core::study::Questions {
        combination,
        growth,
        eigenvalues,
        normal_force,
        hopf: hopf.map(|(contacts, lower, upper)| core::study::HopfRange {
            contacts,
            lower,
            upper,
        }),
        motion,
    };
    let (rows, scenes) = samples.taken(py)?;
    let source = samples.source(&rows, &scenes);
    let found =
        interruptible(py, threads, |cancel| core::study::answers(&source, &questions, cancel))?;
    columns(py, found, sizes, &questions)
}

/// Computes on other threads while this one listens for Ctrl-C.
fn interruptible<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    compute: impl Fn(&core::Cancel) -> T + Send + Sync,
) -> PyResult<T> {
    let pool = threads
        .map(|count| core::study::pool(count).map_err(|error| named(py, "InputError", &error)))
        .transpose()?;
    let (computed, interrupted) = py.detach(|| {
        until_interrupted(|cancel| match &pool {
            Some(pool) => pool.install(|| compute(cancel)),
            None => compute(cancel),
        })
    })?;
    interrupted.map_or(Ok(computed), Err)
}

fn columns<'py>(
    py: Python<'py>,
    mut answers: Vec<core::study::Answer>,
    (dofs, contacts, modes): (usize, usize, usize),
    questions: &core::study::Questions,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let count = answers.len();
    let real = |key: &str, entry: &dyn Fn(&core::study::Answer) -> f64| {
        dict.set_item(key, answers.iter().map(entry).collect::<Vec<f64>>().into_pyarray(py))
    };
    let table = |key: &str, width: usize, row: &dyn Fn(&core::study::Answer) -> Option<&[f64]>| {
        let mut entries = Vec::with_capacity(count * width);
        for answer in &answers {
            match row(answer) {
                Some(values) if values.len() == width => entries.extend_from_slice(values),
                _ => entries.extend(std::iter::repeat_n(f64::NAN, width)),
            }
        }
        dict.set_item(key, matrix(py, count, width, entries)?)
    };
    let nan = Complex64::new(f64::NAN, f64::NAN);
    if questions.growth {
        let least =
            |answer: &core::study::Answer| answer.growth.map_or(nan, |growth| growth.eigenvalue);
        dict.set_item(
            "eigenvalue",
            answers.iter().map(least).collect::<Vec<_>>().into_pyarray(py),
        )?;
        real("growth_rate", &|answer| least(answer).re)?;
        real("frequency", &|answer| least(answer).norm() / std::f64::consts::TAU)?;
        let unstable: Vec<i64> = answers
            .iter()
            .map(|answer| answer.growth.map_or(-1, |growth| growth.unstable_modes as i64))
            .collect();
        dict.set_item("unstable_modes", unstable.into_pyarray(py))?;
    }
    if questions.eigenvalues {
        let mut entries = Vec::with_capacity(count * modes);
        for answer in &answers {
            match answer.eigenvalues.len() == modes {
                true => entries.extend_from_slice(&answer.eigenvalues),
                false => entries.extend(std::iter::repeat_n(nan, modes)),
            }
        }
        dict.set_item("eigenvalues", entries.into_pyarray(py).reshape([count, modes])?)?;
    }
    if questions.normal_force {
        table("normal_force", contacts, &|answer| Some(&answer.normal_force))?;
    }
    if questions.hopf.is_some() {
        real("hopf_point", &|answer| answer.hopf.map_or(f64::NAN, |point| point.0))?;
        real("hopf_frequency", &|answer| {
            answer.hopf.map_or(f64::NAN, |point| point.1 / std::f64::consts::TAU)
        })?;
    }
    if let Some(asked) = &questions.motion {
        let events: Vec<i64> = answers
            .iter()
            .map(|answer| answer.motion.as_ref().map_or(-1, |motion| motion.events as i64))
            .collect();
        dict.set_item("events", events.into_pyarray(py))?;
        if asked.settle {
            fn settled(answer: &core::study::Answer) -> Option<&core::study::Settled> {
                answer.motion.as_ref()?.settled.as_ref()
            }
            let kinds: Vec<&str> = answers
                .iter()
                .map(|answer| settled(answer).map_or("", |s| s.kind.name()))
                .collect();
            dict.set_item("attractor", kinds)?;
            let verdicts: Vec<&str> = answers
                .iter()
                .map(|answer| match settled(answer).and_then(|s| s.stability) {
                    None => "",
                    Some(stability) => match stability.is_stable() {
                        Some(true) => "stable",
                        Some(false) => "unstable",
                        None => "not known",
                    },
                })
                .collect();
            dict.set_item("stability", verdicts)?;
            let sequences: Vec<Vec<String>> = answers
                .iter()
                .map(|answer| {
                    settled(answer).map_or(Vec::new(), |s| {
                        s.sequence.iter().map(|combination| combination.to_string()).collect()
                    })
                })
                .collect();
            dict.set_item("sequence", sequences)?;
            let of = |f: fn(&core::study::Settled) -> f64| {
                move |answer: &core::study::Answer| settled(answer).map_or(f64::NAN, f)
            };
            let growth = |f: fn(core::cycles::attractors::Lyapunov) -> f64| {
                move |answer: &core::study::Answer| {
                    settled(answer).and_then(|s| s.growth).map_or(f64::NAN, f)
                }
            };
            real("exponent", &growth(|growth| growth.exponent))?;
            real("exponent_error", &growth(|growth| growth.error))?;
            real("exponent_time", &growth(|growth| growth.time))?;
            real("period", &of(|s| s.period))?;
            real("cycle_frequency", &of(|s| 1.0 / s.period))?;
            real("largest_multiplier", &of(|s| s.multiplier))?;
            table("amplitude", dofs, &|answer| settled(answer).map(|s| &s.amplitude[..]))?;
        }
        if asked.energy {
            fn energy(answer: &core::study::Answer) -> Option<&core::study::CycleEnergy> {
                answer.motion.as_ref()?.settled.as_ref()?.energy.as_ref()
            }
            table("contact_energy", contacts, &|answer| energy(answer).map(|e| &e.contact[..]))?;
            table("slider_energy", contacts, &|answer| energy(answer).map(|e| &e.slider[..]))?;
            real("energy_per_cycle", &|answer| energy(answer).map_or(f64::NAN, |e| e.dissipated))?;
        }
    }
    let status: Vec<&str> = answers
        .iter()
        .map(|answer| answer.failure.as_ref().map_or("ok", |failure| failure.kind.name()))
        .collect();
    dict.set_item("status", status)?;
    let reason: Vec<&str> = answers
        .iter()
        .map(|answer| answer.failure.as_ref().map_or("", |failure| failure.reason.as_str()))
        .collect();
    dict.set_item("reason", reason)?;
    if questions.motion.as_ref().is_some_and(|motion| motion.keep) {
        let runs = answers
            .iter_mut()
            .map(|answer| {
                answer.run.take().map(|(start, run)| {
                    (
                        start.position.into_pyarray(py),
                        start.velocity.into_pyarray(py),
                        start.combination.to_string(),
                        Trajectory::new(run),
                    )
                })
            })
            .collect::<Vec<_>>();
        dict.set_item("runs", runs)?;
    }
    Ok(dict)
}

/// What the results of floating-point arithmetic depend on besides the program: target and vector extensions.
#[pyfunction]
pub fn arithmetic() -> (String, Vec<&'static str>) {
    core::numerics::arithmetic()
}
