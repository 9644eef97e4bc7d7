//! Records as bytes: a head of kind and format, then the fields in the order in which the types of the record declare them.

use serde::{Deserialize, Serialize};

use crate::error::input::{Error, refused};

/// The format of all records. Bytes of another format are refused, so it counts up with every change of a field or a variant of
/// what a record holds.
const FORMAT: u32 = 1;

/// The bytes of a record; `kind` keeps records of motions and of orbits apart.
pub(crate) fn encoded<T: Serialize>(kind: &str, record: &T) -> Vec<u8> {
    let Ok(bytes) = postcard::to_allocvec(&(kind, FORMAT, record)) else {
        unreachable!("every field of a record has a form in bytes")
    };
    bytes
}

/// The record of that kind in some bytes, whose values may still be those of no motion.
pub(crate) fn decoded<'a, T: Deserialize<'a>>(kind: &str, bytes: &'a [u8]) -> Result<T, Error> {
    match postcard::take_from_bytes::<(&str, u32)>(bytes) {
        Ok(((named, FORMAT), fields)) if named == kind => match postcard::take_from_bytes(fields) {
            Ok((record, [])) => Ok(record),
            _ => Err(refused("bytes that are cut short or damaged")),
        },
        Ok(((named, format), _)) if named == kind => {
            Err(Error::RecordFormat { format, read: FORMAT })
        }
        _ => Err(refused("bytes of another kind")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_kinds_formats_and_lengths_are_refused() {
        let whole = encoded("motion", &(1.5_f64, vec![2_usize]));
        type Fields = (f64, Vec<usize>);
        assert_eq!(decoded::<Fields>("motion", &whole), Ok((1.5, vec![2])));
        assert_eq!(decoded::<Fields>("orbit", &whole), Err(refused("bytes of another kind")));
        for end in 0..whole.len() {
            assert!(decoded::<Fields>("motion", &whole[..end]).is_err(), "{end}");
        }
        assert!(decoded::<Fields>("motion", &[&whole[..], &[0]].concat()).is_err());
        let Ok(later) = postcard::to_allocvec(&("motion", FORMAT + 1, 1.5)) else { panic!() };
        let refusal = Error::RecordFormat { format: FORMAT + 1, read: FORMAT };
        assert_eq!(decoded::<Fields>("motion", &later), Err(refusal));
    }

    /// A length beyond all memory takes none.
    #[test]
    fn a_length_that_nothing_follows_is_refused() {
        let Ok(mut bytes) = postcard::to_allocvec(&("motion", FORMAT, u64::MAX)) else { panic!() };
        assert!(decoded::<Vec<f64>>("motion", &bytes).is_err());
        bytes.extend([0; 64]);
        assert!(decoded::<Vec<f64>>("motion", &bytes).is_err());
    }
}
