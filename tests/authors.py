"""The authors' networks and files, written from their description in plain PyTorch: a reference for the tests."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
import trimesh
from torch import nn

GLOBAL, LOCAL = 8, 12  # small latents; the released ones have 32 and 128


def mlp(sizes: list[int], bend: type[nn.Module]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for one, other in pairwise(sizes):
        layers += [nn.Linear(one, other), bend()]
    return nn.Sequential(*layers[:-1])


class MlpEncoder(nn.Module):
    def __init__(self, inputs: int, latent: int, waves: bool) -> None:
        super().__init__()
        self.waves = waves
        self.encoder_net = mlp([inputs, 64, 128, 128, latent], nn.ReLU)

    def forward(self, x: torch.Tensor, params: torch.Tensor) -> torch.Tensor:
        seen = [x]
        for k in range(6 if self.waves else 0):
            seen += [torch.sin(2**k * torch.pi * x), torch.cos(2**k * torch.pi * x)]
        return self.encoder_net(torch.cat([*seen, params.expand(len(x), -1)], dim=1))


class Stn(nn.Module):
    def __init__(self, norm: bool) -> None:
        super().__init__()
        sizes = [3, 64, 128, 1024]
        for k in range(3):
            setattr(self, f"conv{k + 1}", nn.Conv1d(sizes[k], sizes[k + 1], 1))
        sizes = [1024, 512, 256, 9]
        for k in range(3):
            setattr(self, f"fc{k + 1}", nn.Linear(sizes[k], sizes[k + 1]))
        for k, size in enumerate((64, 128, 1024, 512, 256)):
            setattr(self, f"bn{k + 1}", nn.BatchNorm1d(size) if norm else nn.Identity())

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        for k in (1, 2, 3):
            x = F.relu(getattr(self, f"bn{k}")(getattr(self, f"conv{k}")(x)))
        x = x.max(dim=2).values
        x = F.relu(self.bn4(self.fc1(x)))
        x = F.relu(self.bn5(self.fc2(x)))
        return self.fc3(x).view(-1, 3, 3) + torch.eye(3)


class PointEncoder(nn.Module):
    def __init__(self, params: int, latent: int, norm: bool) -> None:
        super().__init__()
        self.stn = Stn(norm)
        sizes = [3 + params, 64, 128, latent]
        for k in range(3):
            setattr(self, f"conv{k + 1}", nn.Conv1d(sizes[k], sizes[k + 1], 1))
            setattr(self, f"bn{k + 1}", nn.BatchNorm1d(sizes[k + 1]) if norm else nn.Identity())

    def forward(self, x: torch.Tensor, params: torch.Tensor) -> torch.Tensor:
        x = x.T[None]
        x = torch.bmm(x.transpose(1, 2), self.stn(x)).transpose(1, 2)
        x = torch.cat([x, params[None, :, None].expand(1, -1, x.shape[2])], dim=1)
        x = F.relu(self.bn1(self.conv1(x)))
        x = F.relu(self.bn2(self.conv2(x)))
        return self.bn3(self.conv3(x))[0].T


class Field(nn.Module):
    def __init__(self, latent: int, condition: int) -> None:
        super().__init__()
        self.mlp_net = mlp([latent + condition + 1, *[2 * latent] * 5, latent], nn.Tanh)


class Decoder(nn.Module):
    def __init__(self, latent: int, out: int) -> None:
        super().__init__()
        self.decoder_net = mlp([latent, latent, latent // 2, out], nn.ReLU)


class Half(nn.Module):
    """One of the two networks."""

    def __init__(self, encoder: nn.Module, latent: int, condition: int, out: int) -> None:
        super().__init__()
        self.encoder, self.ode_func, self.decoder = encoder, Field(latent, condition), Decoder(latent, out)

    def roll(self, z: torch.Tensor, condition: torch.Tensor, times: torch.Tensor) -> list[torch.Tensor]:
        def f(t: torch.Tensor, z: torch.Tensor) -> torch.Tensor:
            given = torch.cat([condition, t.view(1)]).expand(len(z), -1)
            return self.ode_func.mlp_net(torch.cat([z, given], dim=1))

        out = [z]
        for t, s in pairwise(times):
            h = s - t
            k1 = f(t, z)
            k2 = f(t + h / 3, z + h * k1 / 3)
            k3 = f(t + 2 * h / 3, z + h * (k2 - k1 / 3))
            k4 = f(s, z + h * (k1 - k2 + k3))
            z = z + h * (k1 + 3 * k2 + 3 * k3 + k4) / 8
            out.append(z)
        return out


class Authors:
    """Both networks with random weights, and what they say."""

    def __init__(self, kind: str, offsets: int, seed: int = 0) -> None:
        torch.manual_seed(seed)
        self.kind, self.offsets = kind, offsets
        params = {1: 2, 3: 6}[offsets]
        if kind.startswith("pointnet"):
            encoder: nn.Module = PointEncoder(params, LOCAL, kind == "pointnet_bn")
        else:
            encoder = MlpEncoder(params + (39 if kind == "pemlp" else 3), LOCAL, kind == "pemlp")
        self.whole = Half(MlpEncoder(offsets + params, GLOBAL, False), GLOBAL, 0, offsets).eval()
        self.local = Half(encoder, LOCAL, GLOBAL, 3).eval()
        for half in (self.whole, self.local):
            for weight in half.ode_func.parameters():
                weight.data *= 3.0  # fields bent enough to tell one solver from another
        for module in self.local.modules():
            if isinstance(module, nn.BatchNorm1d):
                module.running_mean = torch.randn_like(module.running_mean) * 0.1  # pyright: ignore
                module.running_var = torch.rand_like(module.running_var) + 0.5  # pyright: ignore
                nn.init.uniform_(module.weight, 0.5, 1.5)
                nn.init.uniform_(module.bias, -0.2, 0.2)

    @torch.no_grad()
    def world(self, rest: np.ndarray, params: list[float], offset: list[float], times: np.ndarray) -> np.ndarray:
        """(T, N, 3) metres, of normalised parameters and an offset in metres."""
        mean = rest.mean(axis=0)
        low, high = (rest - mean).min(), (rest - mean).max()
        seen = torch.tensor(2.0 * ((rest - mean - low) / (high - low) - 0.5)).float()
        scale, given, clock = {1: 2.0, 3: 5.0}[self.offsets], torch.tensor(params), torch.tensor(times).float()
        start = self.whole.encoder(scale * torch.tensor([offset]), given)
        whole = self.whole.roll(start, torch.zeros(0), clock)
        local = self.local.roll(self.local.encoder(seen, given), whole[1][0], clock)
        shapes = torch.stack([self.local.decoder.decoder_net(z) for z in local]).numpy().astype(float)
        shifts = torch.stack([self.whole.decoder.decoder_net(z) for z in whole]).numpy().astype(float) / scale
        if self.offsets == 1:
            shifts = np.pad(shifts, ((0, 0), (0, 0), (2, 0)))
        return (shapes / 2.0 + 0.5) * (high - low) + low + mean + shifts

    def save(self, path: Path, **changes: object) -> Path:
        experiment = "mass_elastic" if self.offsets == 1 else "contact_force"
        start, count, rate = (40, 20, 20) if self.offsets == 1 else (0, 10, 10)
        args = {"experiment": experiment, "fps": rate, "seq_start_idx": start, "sequence_length": count}
        content = {
            "model1_state_dict": self.whole.state_dict(),
            "model2_state_dict": self.local.state_dict(),
            "awl_state_dict": {"params": torch.ones(2)},
            "optimizer_state_dict": {},
            "epoch": 3,
            "loss": 0.1,
            "args": args,
        }
        torch.save({**content, **changes}, path)
        return path


def write_sequence(
    root: Path, name: str, shapes: np.ndarray, offsets: np.ndarray, params: dict[str, object], first: int = 0
) -> None:
    """A sequence in the released layout: `shapes` (T, N, 3) of a tetrahedron, `offsets` (T,) or (T, 3)."""
    folder = root / name
    (folder / "xyz_meshes").mkdir(parents=True)
    (folder / "params.json").write_text(json.dumps(params))
    key = "offset_z_vertices_list" if offsets.ndim == 1 else "rigid_pose_list"
    (folder / "metadata.json").write_text(json.dumps({key: offsets.tolist()}))
    for k, shape in enumerate(shapes, first):
        np.savetxt(folder / "xyz_meshes" / f"{name}_{k}.xyz", np.hstack([shape, np.zeros_like(shape)]), fmt="%.9f")
        trimesh.Trimesh(shape, TETRAHEDRON, process=False).export(folder / f"{name}_{k}.ply")


TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
