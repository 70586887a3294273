"""The network for training and its numpy twin for inference."""

import numpy as np
import pytest
import torch
import trimesh

from odeform.geometry.shape import surface_weights
from odeform.models.latent.config import ModelConfig
from odeform.models.latent.inference import make_decoder, make_encoder, make_field, pool_shape
from odeform.models.latent.network import ODeformNet, ShapeEncoder
from odeform.models.latent.training.loop import network_weights
from odeform.solver.integrate import SolverSettings, integrate
from odeform.types import Mesh

Shape = tuple[torch.Tensor, torch.Tensor]


def shape(level: int = 3, stretch: float = 1.0) -> Shape:
    sphere = trimesh.creation.icosphere(level)
    mesh = Mesh(np.asarray(sphere.vertices) * [stretch, 1.0, 1.0], np.asarray(sphere.faces))
    return torch.as_tensor(mesh.points).float(), torch.as_tensor(surface_weights(mesh)).float()


def network(rigid: bool, random_features: int = 0) -> ODeformNet:
    """Untrained, but with every buffer different from what would hide a mistake."""
    torch.manual_seed(0)
    net = ODeformNet(ModelConfig(parameters=4, modes=7, rigid=rigid))
    net.gains.copy_(torch.linspace(0.1, 2.0, 13))
    net.time_scale.fill_(0.05)
    for encoder in net.encoders:
        encoder.standardise([shape(stretch=s) for s in (0.7, 1.0, 1.6)])
        assert (encoder.pooled_gain > 0.0).any()
    if random_features:
        net.widen(random_features)
    return net


@pytest.mark.parametrize("rigid", [True, False])
@pytest.mark.parametrize("random_features", [0, 30])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_inference_equals_the_network(rigid: bool, random_features: int, dtype: type) -> None:
    net = network(rigid, random_features)
    weights, config = network_weights(net), net.config
    points, shares = shape(stretch=1.3)
    theta = torch.tensor([[0.3, -0.8, 1.2, 0.0]])
    with torch.no_grad():
        state = net.encode((points, shares), theta)
        rolled = net.roll_out(state, theta, [0.02, 0.02])[:, 0]
    vector = theta[0].double().numpy()
    pooled = pool_shape(weights, config, points.double().numpy(), shares.double().numpy())
    start = make_encoder(weights, config)(pooled, vector, dtype)
    assert start.dtype == dtype
    assert np.allclose(start, state[0], rtol=1e-5, atol=1e-5)
    field = make_field(weights, config, dtype)(vector)
    assert field(0.0, start).dtype == dtype
    solution = integrate(field, start, SolverSettings("rk4", step=0.02), 0.04)
    assert np.allclose(np.stack(solution.states[:3]), rolled, rtol=1e-5, atol=1e-5)
    far = torch.stack([state, state + 0.7])
    with torch.no_grad():
        moved = (net.decode(far, torch.tensor([0.0, 0.3]), theta) * net.gains)[:, 0]
    decoded = make_decoder(weights, config)(vector)(np.array([0.0, 0.3]), far[:, 0].numpy())
    assert np.allclose(decoded - decoded[0], moved, rtol=1e-4, atol=1e-5)


def test_pooling_ignores_order_and_density() -> None:
    encoder = network(True).local_encoder
    points, shares = shape(3)
    order = torch.randperm(len(points), generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        pooled = encoder.pool(points, shares)
        assert torch.allclose(encoder.pool(points[order], shares[order]), pooled, atol=1e-6)
        finer = encoder.pool(*shape(4))
        longer = encoder.pool(*shape(3, stretch=1.6))
    # well below what `standardise` takes for a shape of its own
    assert (finer - pooled).abs().max() < 1e-3
    assert (longer - pooled).abs().max() > 1e-2


def test_shape_matters_only_where_shapes_varied() -> None:
    torch.manual_seed(0)
    encoder = ShapeEncoder(ModelConfig(parameters=2, modes=3).sizes("local"))
    ball, egg = shape(), shape(stretch=1.5)
    theta = torch.tensor([[0.1, -0.2]])

    def latents() -> tuple[torch.Tensor, torch.Tensor]:
        with torch.no_grad():
            one, two = (encoder(encoder.pool(*s)[None], theta) for s in (ball, egg))
        return one, two

    encoder.standardise([ball])
    one, two = latents()
    assert torch.equal(one, two)
    encoder.standardise([ball, shape(4)])
    one, two = latents()
    assert torch.equal(one, two), "two meshes of one ball are one shape"
    encoder.standardise([ball, egg])
    one, two = latents()
    assert (one - two).abs().max() > 1e-2
    with torch.no_grad():
        pooled = torch.stack([encoder.pool(*s) for s in (ball, egg)])
    features = (pooled - encoder.pooled_mean) * encoder.pooled_gain
    alive = encoder.pooled_gain > 0.0
    assert torch.allclose(features[:, alive].std(dim=0, correction=0), torch.ones(int(alive.sum())), atol=1e-4)


def test_global_motion_drives_the_local_one_and_not_the_reverse() -> None:
    """Coupling goes one way (paper, III-C)."""
    net = network(True)
    split, theta = net.config.rigid_latent, torch.zeros(1, 4)
    state = torch.randn(1, net.config.state, generator=torch.Generator().manual_seed(0))
    jacobian = torch.autograd.functional.jacobian(lambda z: net.roll_out(z, theta, [0.01])[1, 0], state)[:, 0]
    assert not jacobian[:split, split:].any()
    assert jacobian[split:, :split].abs().max() > 0.0
    assert (jacobian[:split, :split] - torch.eye(split)).abs().max() > 0.0
