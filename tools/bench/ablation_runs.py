"""The runs of tools/bench/ablation, by group: each is a change of one configuration."""

import collections

DEPTH, NORMAL, MASK = ["data.use_pred_depth=true"], ["data.use_pred_normal=true"], ["data.use_mask=true"]
PLANE, PLANE_LOSS = ["data.use_pred_plane=true"], ["opt.lambda_plane=10"]
BOTH = DEPTH + NORMAL
EDGES = ["opt.lambda_edge=0.1", "opt.edge_filter=sobel"]
FILM = ["cam_embd.embedding=pose", "cam_embd.dimension=10", "data.custom_embedding=true"]

# rate: relative to --rate, with adapters to --adapter-rate, with a base to --scratch-rate; against: the runs that it is
# compared with; base: the configuration that is trained from its beginning, none: --from is continued; data: a data set
# that ablation_data.py derives from --data; after: the run of the same seed whose weights it continues, grafted;
# inputs: numbers of the views that it is scored from
Run = collections.namedtuple("Run", "name text changes against adapters rate base data after inputs",
                             defaults=((), False, 1.0, None, None, None, None))
SCRATCH_SIDE = 32
F3D = ["model.head=f3d", *MASK]
# Half of the views are novel ones, else nothing but the input views would be supervised.
FOUR = ["data.input_images=4", "opt.imgs_per_obj=8"]
AROUND = "64,80,96,112"  # views of test objects, a quarter turn apart
LGM = ["data.training_resolution=32", "data.fov=51.98948897809546", "data.znear=0.8", "data.zfar=1.8",
       "model.down=[32,64,128]", "model.down_attention=[0,0,1]", "model.up=[128,64,32]", "model.up_attention=[1,0,0]",
       "opt.imgs_per_obj=8", "opt.ema.use=true"]

# One line for each prior: name, text, changes, and the data sets that hold it exactly and as it is estimated.
PRIORS = [
    ("depth", "depth", DEPTH, None, "estimated"),
    ("normal", "normals", NORMAL, None, "estimated"),
    ("mask", "masks", MASK, None, "estimated"),
    ("edges", "edges", DEPTH, "edges_of_depth", "edges_of_pictures"),
    ("plane", "planes", PLANE, "planes", "estimated_planes"),
]
ALL = ("all", "depth, normals and masks", BOTH + MASK, None, "estimated")


def priors(rows, rgb, prefix="", after=None):
    """Each prior exactly, and as it is estimated."""
    return [Run(f"{prefix}{name}_{kind}", f"+ {text}, {kind}", changes, against, base="small", data=data, after=after)
            for name, text, changes, exact, estimated in rows
            for kind, data, against in (("exact", exact, (rgb,)),
                                        ("estimated", estimated, (rgb, f"{prefix}{name}_exact")))]


def lora(rank, alpha, dropout=0.0, against=(), first_conv=True, rate=1.0, name=None, note=""):
    text = f"+ both, LoRA {rank}, alpha {alpha}" + (f", dropout {dropout}" if dropout else "") + note
    changes = BOTH + ["opt.lora_finetune=true", f"opt.lora_rank={rank}", f"opt.lora_alpha={alpha}",
                      f"opt.lora_dropout={dropout}"]
    if first_conv:
        changes.append("opt.train_with_adapters=[{side}x{side}_conv.]")
    return Run(name or f"r{rank}a{alpha}d{dropout:g}", text, changes, against, True, rate)


def conditioned(name, text, changes):
    return Run(name, text, changes, ("nothing",), base="small", data="conditioned")


SMALL_RGB = Run("rgb_small", "RGB", [], base="small")

GROUPS = {
    "core": [
        Run("rgb", "RGB, all weights", [], ("start",)),
        Run("both", "+ both, all weights", BOTH, ("rgb", "start")),
        lora(8, 8, against=("both", "frozen", "start")),
        lora(8, 8, against=("rgb", "start"), first_conv=False, name="frozen", note=", first convolution frozen"),
    ],
    "priors": [
        Run("depth", "+ depth, all weights", DEPTH, ("rgb", "both")),
        Run("normal", "+ normals, all weights", NORMAL, ("rgb", "both")),
    ],
    "ranks": [lora(rank, rank, against=("both", "r8a8d0")) for rank in (4, 32)],
    "published": [
        lora(8, 8, 0.05, ("r8a8d0",)),
        lora(8, 8, 0.1, ("r8a8d0",)),
        lora(16, 16, against=("r8a8d0",)),
        lora(32, 16, 0.05, ("r32a32d0",)),
        lora(32, 16, 0.5, ("r32a32d0",)),
        lora(32, 32, 0.5, ("r32a32d0",)),
    ],
    "alpha": [lora(8, alpha, against=("r8a8d0",)) for alpha in (4, 16, 32)],
    "rates": [run for rate in (0.4, 2.5) for run in (
        Run(f"both_rate{rate}", f"+ both, all weights, rate x {rate}", BOTH, ("both",), rate=rate),
        lora(8, 8, against=("r8a8d0",), rate=rate, name=f"r8a8_rate{rate}", note=f", rate x {rate}"))],
    "losses": [
        Run("edges", "RGB, loss on Sobel edges of weight 0.1", EDGES, ("rgb",)),
        Run("edges_by_size", "the same, by size of Gaussians", EDGES + ["opt.edge_by_size=true"], ("rgb",)),
    ],
    "masks": [
        Run("film", "mask as embedding, FiLM", FILM + ["data.embedding_file={out}/masks_film.npz"], ("rgb",)),
        Run("tokens", "mask as tokens, attention",
            ["data.tokens_file={out}/masks_tokens.npz", "model.token_dim=64", "model.tokens={tokens}"], ("rgb",)),
    ],
    "heads": [
        Run("depth_channel", "one view, depth as a channel", DEPTH, base="small"),
        Run("f3d", "one view, the same depth for the head", F3D, ("depth_channel",), base="small"),
        Run("cycle", "the same, a cycle in each second step", F3D + ["opt.cycle.every=2"], ("f3d",), base="small"),
        Run("four_views", "four views, Splatter Image's network", FOUR, base="small", inputs=AROUND),
        Run("lgm", "four views, LGM's network", LGM, ("four_views",), rate=0.5, base="lgm-tiny", inputs=AROUND),
    ],
    "conditioning": [
        Run("nothing", "nothing", [], base="small", data="conditioned"),
        conditioned("broadcast", "as constant input channels", BOTH + MASK),
        conditioned("film_small", "FiLM", ["cam_embd.embedding=pose", "cam_embd.dimension=2", "cam_embd.film=affine",
                                           "data.custom_embedding=true", "data.embedding_file={data}/embedding.npz"]),
        conditioned("attention", "cross-attention", ["data.tokens_file={data}/tokens.npz", "model.token_dim=6",
                                                     "model.tokens=3"]),
    ],
    "estimates": [SMALL_RGB, *priors(PRIORS, "rgb_small")],
    "together": [SMALL_RGB, *priors([ALL], "rgb_small")],
    "grafted": [SMALL_RGB, Run("rgb_longer", "RGB, as many steps again", [], base="small", after="rgb_small"),
                *priors([*PRIORS, ALL], "rgb_longer", "grafted_", "rgb_small")],
    "edge_loss": [
        SMALL_RGB,
        Run("edge_loss", "+ loss on Sobel edges of weight 0.1", EDGES, ("rgb_small",), base="small"),
        Run("edge_loss_by_size", "the same, by size of Gaussians", EDGES + ["opt.edge_by_size=true"],
            ("rgb_small", "edge_loss"), base="small"),
    ],
    "planes": [
        SMALL_RGB,
        Run("plane_exact", "+ planes, exact", PLANE, ("rgb_small",), base="small", data="planes"),
        Run("plane_loss", "+ loss of planes of weight 10", PLANE_LOSS, ("rgb_small",), base="small", data="planes"),
        Run("plane_both", "+ both", PLANE + PLANE_LOSS, ("rgb_small", "plane_exact", "plane_loss"), base="small",
            data="planes"),
    ],
}

# Groups whose runs share a table, the mark around it and its page; all others are in "ablation".
STUDIES = {"heads": ("heads", "BENCHMARKS.md"), "conditioning": ("conditioning", "docs/studies.md"),
           "estimates": ("priors", "docs/studies.md"), "together": ("priors", "docs/studies.md"),
           "grafted": ("priors", "docs/studies.md"), "edge_loss": ("edge_loss", "docs/studies.md"),
           "planes": ("planes", "docs/studies.md")}


def study_of(group):
    return STUDIES.get(group, ("ablation", "BENCHMARKS.md"))
