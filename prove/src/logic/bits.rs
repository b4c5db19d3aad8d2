//! Numbers as lists of literals, the lowest bit first, with the operations of the IR on them.

use super::{FALSE, Graph, Lit, TRUE};

impl Graph {
    /// A constant of a width.
    pub fn number(&self, width: usize, value: i64) -> Vec<Lit> {
        (0..width).map(|bit| Lit::constant(value >> bit.min(63) & 1 == 1)).collect()
    }

    /// `a` where `cond` is true, else `b`.
    pub fn choose_bits(&mut self, cond: Lit, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        a.iter().zip(b).map(|(&a, &b)| self.choose(cond, a, b)).collect()
    }

    /// The sum with a carry, and the carry out.
    pub fn add_carry(&mut self, a: &[Lit], b: &[Lit], mut carry: Lit) -> (Vec<Lit>, Lit) {
        let mut sum = Vec::with_capacity(a.len());
        for (&a, &b) in a.iter().zip(b) {
            let half = self.xor(a, b);
            sum.push(self.xor(half, carry));
            let both = self.and(a, b);
            let through = self.and(half, carry);
            carry = self.or(both, through);
        }
        (sum, carry)
    }

    /// The wrapping sum.
    pub fn add(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        self.add_carry(a, b, FALSE).0
    }

    /// All bits inverted.
    pub fn invert(&self, a: &[Lit]) -> Vec<Lit> {
        a.iter().map(|&bit| !bit).collect()
    }

    /// The wrapping difference, and whether there was no borrow: whether `a` is at least `b`, unsigned.
    pub fn subtract(&mut self, a: &[Lit], b: &[Lit]) -> (Vec<Lit>, Lit) {
        let b = self.invert(b);
        self.add_carry(a, &b, TRUE)
    }

    /// 0 minus a number.
    pub fn negate(&mut self, a: &[Lit]) -> Vec<Lit> {
        let zero = self.number(a.len(), 0);
        self.subtract(&zero, a).0
    }

    /// The negative of a number where `cond` is true, else the number.
    pub fn negate_if(&mut self, cond: Lit, a: &[Lit]) -> Vec<Lit> {
        if cond == FALSE {
            return a.to_vec();
        }
        let negative = self.negate(a);
        self.choose_bits(cond, &negative, a)
    }

    /// Whether two numbers are equal.
    pub fn equal(&mut self, a: &[Lit], b: &[Lit]) -> Lit {
        let mut all = TRUE;
        for (&a, &b) in a.iter().zip(b) {
            let differ = self.xor(a, b);
            all = self.and(all, !differ);
        }
        all
    }

    /// Whether a number is not 0.
    pub fn is_not_zero(&mut self, a: &[Lit]) -> Lit {
        self.any(a.iter().copied())
    }

    /// Whether one number is less than another, unsigned.
    pub fn less_unsigned(&mut self, a: &[Lit], b: &[Lit]) -> Lit {
        let mut less = FALSE;
        for (&a, &b) in a.iter().zip(b) {
            let differ = self.xor(a, b);
            less = self.choose(differ, b, less);
        }
        less
    }

    /// Whether one number is less than another, in two's complement.
    pub fn less_signed(&mut self, a: &[Lit], b: &[Lit]) -> Lit {
        // Without the copies of signs that both have, so that numbers of other widths are compared by the same gates.
        let copies = |bits: &[Lit]| {
            let sign = bits.last();
            bits.iter().rev().skip(1).take_while(|bit| Some(*bit) == sign).count()
        };
        let copies = copies(a).min(copies(b));
        let flip = |bits: &[Lit]| {
            let mut bits = bits.to_vec();
            bits.truncate(bits.len().saturating_sub(copies));
            if let Some(sign) = bits.last_mut() {
                *sign = !*sign;
            }
            bits
        };
        self.less_unsigned(&flip(a), &flip(b))
    }

    /// The bits of a number with others in front, or without those that are too many.
    pub fn resize(&self, a: &[Lit], width: usize, fill: Lit) -> Vec<Lit> {
        (0..width).map(|bit| a.get(bit).copied().unwrap_or(fill)).collect()
    }

    /// A number with copies of its sign in front, or without the bits that are too many.
    pub fn resize_signed(&self, a: &[Lit], width: usize) -> Vec<Lit> {
        self.resize(a, width, a.last().copied().unwrap_or(FALSE))
    }

    /// The product, as wide as `a`.
    pub fn multiply(&mut self, a: &[Lit], b: &[Lit]) -> Vec<Lit> {
        let width = a.len();
        // The operand with more constant bits decides about the rows.
        let constants = |bits: &[Lit]| bits.iter().filter(|bit| bit.value().is_some()).count();
        let (rows, other) = if constants(a) > constants(b) { (a, b) } else { (b, a) };
        let mut sum = self.number(width, 0);
        for (shift, &row) in rows.iter().enumerate().take(width) {
            if row == FALSE {
                continue;
            }
            let mut addend = vec![FALSE; shift];
            for &bit in other.iter().take(width - shift) {
                addend.push(self.and(row, bit));
            }
            let addend = self.resize(&addend, width, FALSE);
            sum = self.add(&sum, &addend);
        }
        sum
    }

    /// Quotient and remainder, unsigned. Divided by 0 the quotient has all bits 1 and the remainder is `a`.
    pub fn divide_unsigned(&mut self, a: &[Lit], b: &[Lit]) -> (Vec<Lit>, Vec<Lit>) {
        let width = a.len();
        let mut rest = vec![FALSE; width + 1];
        let divisor = self.resize(b, width + 1, FALSE);
        let mut quotient = vec![FALSE; width];
        for bit in (0..width).rev() {
            rest.insert(0, a.get(bit).copied().unwrap_or(FALSE));
            rest.pop();
            let (less, fits) = self.subtract(&rest, &divisor);
            rest = self.choose_bits(fits, &less, &rest);
            if let Some(slot) = quotient.get_mut(bit) {
                *slot = fits;
            }
        }
        rest.pop();
        (quotient, rest)
    }

    /// Quotient rounded towards 0 and remainder with the sign of `a`. Divided by 0 they are ±1 and `a`.
    pub fn divide_signed(&mut self, a: &[Lit], b: &[Lit]) -> (Vec<Lit>, Vec<Lit>) {
        let (sign_a, sign_b) =
            (a.last().copied().unwrap_or(FALSE), b.last().copied().unwrap_or(FALSE));
        let (abs_a, abs_b) = (self.negate_if(sign_a, a), self.negate_if(sign_b, b));
        let (quotient, rest) = self.divide_unsigned(&abs_a, &abs_b);
        let sign = self.xor(sign_a, sign_b);
        (self.negate_if(sign, &quotient), self.negate_if(sign_a, &rest))
    }

    /// A number shifted by a distance: to the left, or to the right with `fill` coming in.
    pub fn shift(&mut self, a: &[Lit], by: &[Lit], left: bool, fill: Lit) -> Vec<Lit> {
        let width = a.len();
        let mut value = a.to_vec();
        for (stage, &cond) in by.iter().enumerate() {
            let distance = if stage < 20 { 1_usize << stage } else { usize::MAX };
            let moved: Vec<Lit> = (0..width)
                .map(|bit| {
                    let from =
                        if left { bit.checked_sub(distance) } else { bit.checked_add(distance) };
                    from.and_then(|from| value.get(from).copied()).unwrap_or(fill)
                })
                .collect();
            value = self.choose_bits(cond, &moved, &value);
        }
        value
    }
}
