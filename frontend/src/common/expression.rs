//! A single expression or condition of a language, checked against a program: for conditions of
//! breakpoints, triggers and watches.
//!
//! Each language reads it with the parser that reads its programs, so that a user writes what the
//! manual says; see `expression.rs` in the language's folder for what is an expression there. What
//! comes of it looks at the process image alone and changes nothing.

use std::{fmt, sync::Arc};

use thiserror::Error;

/// The value of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A truth value: a LOGICAL, a bit, a condition.
    Logical(bool),
    /// A whole number.
    Integer(i64),
    /// A floating-point number, such as the value of a P- or Q-variable of PMAC.
    Real(f64),
}

impl Value {
    /// Whether a condition with this value holds: everything but 0 is true.
    pub fn is_true(self) -> bool {
        match self {
            Self::Logical(value) => value,
            Self::Integer(value) => value != 0,
            Self::Real(value) => value != 0.0,
        }
    }

    /// The value as a number; a truth value is 0 or 1.
    pub fn number(self) -> f64 {
        match self {
            Self::Logical(value) => f64::from(u8::from(value)),
            Self::Integer(value) => value as f64,
            Self::Real(value) => value,
        }
    }
}

/// Why an expression has no value in a given image.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EvaluationError {
    /// An index is outside its array.
    #[error("{array} has {elements} elements, there is no {array}[{index}]")]
    NoElement {
        /// The array's name.
        array: String,
        /// The index.
        index: i64,
        /// How many elements it has; the first is 0.
        elements: u32,
    },
    /// An indirect access reads its address from a word, and the number in that word is not an address.
    #[error("{name} holds no address")]
    NoAddress {
        /// The variable that holds the address.
        name: String,
    },
    /// What the expression reads does not lie in the process image.
    #[error("{name} does not lie in the process image")]
    OutsideImage {
        /// The variable.
        name: String,
    },
    /// The image is not one of the program that the expression was checked against.
    #[error("the process image has {given} bytes, the program's has {expected}")]
    WrongImage {
        /// The size of the program's image in bytes.
        expected: usize,
        /// The size of the image that was given in bytes.
        given: usize,
    },
}

/// What a language makes of an expression.
pub trait Evaluate: fmt::Debug + Send + Sync {
    /// The value in `image`, which is as long as the program's process image.
    ///
    /// # Errors
    /// Where it has none: see [`EvaluationError`].
    fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError>;
}

/// An expression as code: a module with one task, which computes the value and leaves it in the process image. It may use the
/// image behind that of the program, and change the program's status flags and registers, so that it is to be given a copy.
#[derive(Clone, Debug)]
pub struct ExpressionCode {
    /// The code. It traps where the expression has no value.
    pub module: plcc_ir::Module,
    /// The offset in the image where the value lies afterwards. A condition holds if it is not 0.
    pub result: u32,
    /// The type of the value there.
    pub ty: plcc_ir::Type,
}

/// A checked expression. A clone shares its contents.
#[derive(Clone, Debug)]
pub struct Expression {
    text: Arc<str>,
    variables: Arc<[String]>,
    image_size: usize,
    evaluator: Arc<dyn Evaluate>,
}

impl Expression {
    /// What a language made of `text`: the variables that it reads, the size in bytes of the
    /// program's image, and how it is evaluated.
    pub fn new(
        text: &str,
        variables: Vec<String>,
        image_size: usize,
        evaluator: impl Evaluate + 'static,
    ) -> Self {
        let (text, variables) = (text.into(), variables.into());
        Self { text, variables, image_size, evaluator: Arc::new(evaluator) }
    }

    /// The expression as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The names of the variables that it may read, as traces spell them, each once, in the order
    /// in which the text names them. Of an array with a computed index this is the name of the
    /// array.
    pub fn variables(&self) -> &[String] {
        &self.variables
    }

    /// The value of an expression that reads no variable; `None` where it has none.
    pub(crate) fn evaluate_without_image(&self) -> Option<Value> {
        self.evaluator.evaluate(&vec![0; self.image_size]).ok()
    }

    /// The value in an image of the program; nothing is written. Takes time in proportion to the
    /// expression's length.
    ///
    /// # Errors
    /// An index outside its array, an address that is none, and an image of another size than the
    /// program's.
    pub fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
        if image.len() != self.image_size {
            let expected = self.image_size;
            return Err(EvaluationError::WrongImage { expected, given: image.len() });
        }
        self.evaluator.evaluate(image)
    }
}
