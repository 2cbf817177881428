//! `#[derive(Table)]`.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DataStruct, DeriveInput, Error, Field, Fields, Result};

use crate::attributes::{Key, Serde, doc};

pub fn expand(input: DeriveInput) -> Result<TokenStream> {
    let Data::Struct(DataStruct { fields: Fields::Named(fields), .. }) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "a table is a struct with named fields"));
    };
    let name = &input.ident;
    let (mut facts, mut values, mut defaults) = (Vec::new(), Vec::new(), Vec::new());
    for field in &fields.named {
        let key = Key::of(&field.attrs)?;
        let ident = &field.ident;
        let default = default_of(&key);
        defaults.push(quote!(#ident: #default));
        let serde = Serde::of(&field.attrs)?;
        if serde.skip {
            continue;
        }
        let index = facts.len();
        values.push(quote!((&<Self as ::camsim_scenario::keys::Value>::FIELDS[#index],
            ::camsim_scenario::keys::Value::leaf(&self.#ident))));
        facts.push(facts_of(field, serde.rename, &key));
    }
    let description = doc(&input.attrs);
    Ok(quote! {
        impl ::core::default::Default for #name {
            fn default() -> Self {
                Self { #(#defaults),* }
            }
        }

        impl ::camsim_scenario::keys::Value for #name {
            const KIND: ::camsim_scenario::keys::ValueKind = ::camsim_scenario::keys::ValueKind::Table;
            const LIST: ::camsim_scenario::keys::ValueKind = ::camsim_scenario::keys::ValueKind::Tables;
            const FIELDS: &'static [::camsim_scenario::keys::Field] = &[#(#facts),*];
            const ABOUT: &'static str = #description;

            fn leaf(&self) -> ::camsim_scenario::keys::Leaf<'_> {
                ::camsim_scenario::keys::Leaf::Table(self)
            }
        }

        impl ::camsim_scenario::keys::Table for #name {
            fn values(&self) -> ::std::vec::Vec<(&'static ::camsim_scenario::keys::Field,
                ::camsim_scenario::keys::Leaf<'_>)> {
                ::std::vec![#(#values),*]
            }
        }
    })
}

fn default_of(key: &Key) -> TokenStream {
    let value = key.default.as_ref().map(|value| quote!(#value));
    value.unwrap_or_else(|| quote!(::core::default::Default::default()))
}

/// The `Field` of a field.
fn facts_of(field: &Field, rename: Option<String>, key: &Key) -> TokenStream {
    let name = rename.or_else(|| field.ident.as_ref().map(ToString::to_string));
    let (of, description, default) = (&field.ty, doc(&field.attrs), default_of(key));
    let Key { required, unit, step, low, high, only, hint, example, names, .. } = key;
    quote! {
        ::camsim_scenario::keys::Field {
            name: #name,
            about: #description,
            kind: <#of as ::camsim_scenario::keys::Value>::KIND.within(#low, #high),
            fields: <#of as ::camsim_scenario::keys::Value>::FIELDS,
            words: <#of as ::camsim_scenario::keys::Value>::WORDS,
            is_optional: <#of as ::camsim_scenario::keys::Value>::IS_OPTIONAL,
            is_required: #required,
            default: || {
                let value: #of = #default;
                ::std::string::ToString::to_string(&::camsim_scenario::keys::Value::leaf(&value))
            },
            unit: #unit,
            step: #step,
            low: #low,
            high: #high,
            only: &[#(#only),*],
            hint: #hint,
            example: #example,
            names: &[#(#names),*],
        }
    }
}
