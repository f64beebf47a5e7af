//! Assets: bodies from MJCF files, policies from safetensors files.

use bevy::asset::{AssetLoader, AsyncReadExt, LoadContext, io::Reader};
use bevy::prelude::*;
use bevy::reflect::TypePath;
use marathon_learn::Policy;
use marathon_motion::{Clip, MotionError};
use marathon_physics::Model;
use marathon_physics::budget::{self, Limit};
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{Kind, ModelSpec};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;

/// A body that ragdolls are made from. Loaded from `.xml` files (MJCF).
#[derive(Asset, TypePath, Clone, Debug)]
pub struct RagdollPrefab {
    /// The compiled model.
    pub model: Arc<Model>,
}

impl From<Model> for RagdollPrefab {
    fn from(model: Model) -> Self {
        RagdollPrefab { model: Arc::new(model) }
    }
}

/// A policy. Loaded from `.safetensors` files, as `marathon train` writes them.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct PolicyAsset(pub Arc<Policy>);

impl From<Policy> for PolicyAsset {
    fn from(policy: Policy) -> Self {
        PolicyAsset(Arc::new(policy))
    }
}

/// A motion clip. Loaded from `.motion` files, as `marathon motion import` writes them.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct MotionClip(pub Arc<Clip>);

impl From<Clip> for MotionClip {
    fn from(clip: Clip) -> Self {
        MotionClip(Arc::new(clip))
    }
}

/// Why an asset cannot be used.
#[derive(Debug, Error)]
pub enum AssetError {
    /// The file cannot be read.
    #[error("cannot read it: {0}")]
    Read(#[from] std::io::Error),
    /// It is no text.
    #[error("it is not UTF-8 text: {0}")]
    Text(#[from] std::string::FromUtf8Error),
    /// It is no model.
    #[error(transparent)]
    Model(#[from] MjcfError),
    /// It is no motion clip.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// It is no policy.
    #[error(transparent)]
    Policy(#[from] marathon_learn::Error),
}

/// Reads an asset up to a limit of the budget.
async fn read(reader: &mut dyn Reader, limit: &Limit) -> Result<Vec<u8>, std::io::Error> {
    let mut bytes = Vec::new();
    let one_more = limit.most()?.saturating_add(1);
    reader.take(one_more).read_to_end(&mut bytes).await?;
    limit.check(bytes.len() as f64)?;
    Ok(bytes)
}

/// Loads [`RagdollPrefab`]s; included files and height fields are looked up beside the file.
#[derive(Default, TypePath)]
pub struct MjcfLoader;

impl AssetLoader for MjcfLoader {
    type Asset = RagdollPrefab;
    type Settings = ();
    type Error = AssetError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _: &(),
        context: &mut LoadContext<'_>,
    ) -> Result<RagdollPrefab, AssetError> {
        let bytes = read(reader, &budget::MODEL_FILE).await?;
        let text = String::from_utf8(bytes)?;
        let name = context.path().to_string();
        // the compiler asks for files while it runs, but files come by and by: whatever it misses is fetched before the
        // next try
        let mut files: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        loop {
            let missed = RefCell::new(None);
            let result = compile(&text, &name, &|file| {
                let known = files.get(file).cloned();
                known.ok_or_else(|| {
                    *missed.borrow_mut() = Some(file.to_string());
                    "it cannot be read beside the model".to_string()
                })
            });
            let Some(file) = missed.into_inner() else {
                return Ok(RagdollPrefab::from(result?));
            };
            let path = context.path().resolve_embed_str(&file).unwrap_or_else(|_| context.path().clone());
            match context.read_asset_bytes(path).await {
                Ok(content) => files.insert(file, content),
                // the compiler's own message names the place that wants the file
                Err(_) => return Ok(RagdollPrefab::from(result?)),
            };
        }
    }

    fn extensions(&self) -> &[&str] {
        &["xml", "mjcf"]
    }
}

/// Compiles a model, with a geom for obstacles unless its own geoms need the name.
fn compile(text: &str, name: &str, resolve: &dyn Fn(&str) -> Result<Vec<u8>, String>) -> Result<Model, MjcfError> {
    let mut spec = ModelSpec::from_xml_str_with(text, name, resolve)?;
    let taken = spec.get(Kind::Geom, "obstacles").is_ok();
    if !taken {
        spec.add_obstacles()?;
    }
    spec.compile_with(resolve)
}

/// Loads [`PolicyAsset`]s.
#[derive(Default, TypePath)]
pub struct PolicyLoader;

impl AssetLoader for PolicyLoader {
    type Asset = PolicyAsset;
    type Settings = ();
    type Error = AssetError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _: &(),
        context: &mut LoadContext<'_>,
    ) -> Result<PolicyAsset, AssetError> {
        let bytes = read(reader, &budget::POLICY_FILE).await?;
        Ok(Policy::from_bytes(context.path().path(), &bytes)?.into())
    }

    fn extensions(&self) -> &[&str] {
        &["safetensors"]
    }
}

/// Loads [`MotionClip`]s.
#[derive(Default, TypePath)]
pub struct MotionLoader;

impl AssetLoader for MotionLoader {
    type Asset = MotionClip;
    type Settings = ();
    type Error = AssetError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _: &(),
        context: &mut LoadContext<'_>,
    ) -> Result<MotionClip, AssetError> {
        let bytes = read(reader, &budget::CLIP_FILE).await?;
        Ok(Clip::parse(context.path().path(), &bytes)?.into())
    }

    fn extensions(&self) -> &[&str] {
        &["motion"]
    }
}
