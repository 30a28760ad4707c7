//! The grammar of an object's fields: written down once, they give the type, its serialisation and schema, and the
//! reading.

use crate::error::WireError;
use crate::object::Object;

/// Fields that stand in an object, among others or alone.
pub(crate) trait Fields: Sized {
    /// Their names.
    fn names() -> Vec<&'static str>;

    /// Reads them; `object` is the object's name for people.
    ///
    /// # Errors
    /// One is missing that is needed, is of the wrong type, or out of range.
    fn read(object: &str, given: &Object<'_>) -> Result<Self, WireError>;
}

/// Writes a struct of fields down: those that it needs, those that may be left out, and those `with` them that a type
/// of their own reads. `fields!(@names …)` and `fields!(@read …)` are for an operation, whose fields are those of a
/// variant.
macro_rules! fields {
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $wire:literal) => { $wire };
    (@limits) => { None };
    (@limits $limits:ident) => { Some($limits) };
    (@names
        {$($needed:ident $(as $needed_wire:literal)? $(where $needed_limits:ident)?,)*}
        {$($optional:ident $(as $optional_wire:literal)? $(where $optional_limits:ident)?,)*}
        {$($with:ident: $with_type:ty,)*}
    ) => {
        [
            vec![$($crate::fields::fields!(@name $needed $($needed_wire)?),)*],
            vec![$($crate::fields::fields!(@name $optional $($optional_wire)?),)*],
            $(<$with_type as $crate::fields::Fields>::names(),)*
        ]
        .concat()
    };
    (@read $object:ident $given:ident [$($type:tt)+]
        {$($needed:ident $(as $needed_wire:literal)? $(where $needed_limits:ident)?,)*}
        {$($optional:ident $(as $optional_wire:literal)? $(where $optional_limits:ident)?,)*}
        {$($with:ident: $with_type:ty,)*}
    ) => {
        $($type)+ {
            $($needed: $given.needed(
                $object,
                $crate::fields::fields!(@name $needed $($needed_wire)?),
                $crate::fields::fields!(@limits $($needed_limits)?),
            )?,)*
            $($optional: $given.optional(
                $crate::fields::fields!(@name $optional $($optional_wire)?),
                $crate::fields::fields!(@limits $($optional_limits)?),
            )?,)*
            $($with: <$with_type as $crate::fields::Fields>::read($object, $given)?,)*
        }
    };
    (
        $(#[$meta:meta])*
        pub struct $name:ident {$(
            $(#[$needed_doc:meta])*
            $needed:ident: $needed_type:ty,
        )*}
        optional {$(
            $(#[$optional_doc:meta])*
            $optional:ident: $optional_type:ty $(where $limits:ident)?,
        )*}
        $(with {$(
            $(#[$with_doc:meta])*
            $with:ident: $with_type:ty,
        )*})?
    ) => {
        #[derive(serde::Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        $(#[$meta])*
        pub struct $name {
            $(
                $(#[$needed_doc])*
                pub $needed: $needed_type,
            )*
            $(
                $(#[$optional_doc])*
                #[serde(default, skip_serializing_if = "crate::fields::is_default")]
                $(#[cfg_attr(feature = "schema", schemars(range(min = $limits.smallest(), max = $limits.max)))])?
                pub $optional: $optional_type,
            )*
            $($(
                $(#[$with_doc])*
                #[serde(flatten)]
                pub $with: $with_type,
            )*)?
        }

        impl $crate::fields::Fields for $name {
            fn names() -> Vec<&'static str> {
                $crate::fields::fields!(@names {$($needed,)*} {$($optional,)*} {$($($with: $with_type,)*)?})
            }

            #[allow(unused_variables, reason = "not every object needs a field")]
            fn read(object: &str, given: &$crate::object::Object<'_>) -> Result<Self, $crate::error::WireError> {
                Ok($crate::fields::fields!(@read object given [Self]
                    {$($needed,)*}
                    {$($optional $(where $limits)?,)*}
                    {$($($with: $with_type,)*)?}
                ))
            }
        }
    };
    (
        $(#[$meta:meta])*
        pub enum $name:ident {$(
            $(#[$doc:meta])*
            $variant:ident $wire:literal($type:ty),
        )*}
    ) => {
        #[derive(serde::Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        $(#[$meta])*
        pub enum $name {$(
            $(#[$doc])*
            #[serde(rename = $wire)]
            $variant($type),
        )*}

        impl $crate::fields::Fields for $name {
            fn names() -> Vec<&'static str> {
                vec![$($wire),*]
            }

            fn read(object: &str, given: &$crate::object::Object<'_>) -> Result<Self, $crate::error::WireError> {
                let mut read = Vec::new();
                $(read.extend(given.optional::<Option<$type>>($wire, None)?.map(Self::$variant));)*
                match <[Self; 1]>::try_from(read) {
                    Ok([one]) => Ok(one),
                    Err(_) => Err($crate::refusal::not_one_of(object, &Self::names())),
                }
            }
        }
    };
}
pub(crate) use fields;

/// Whether a field that may be left out is left out.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
