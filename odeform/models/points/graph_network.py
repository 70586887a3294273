"""The network of `pe-gnn`: attention between neighbouring nodes of a body, on PyTorch Geometric.

Importing this module needs the extra `gnn`.
"""

import torch
from torch import nn
from torch_geometric.nn import GATv2Conv

__all__ = ["GraphNetwork"]

HEADS = 4
EDGE = 4  # offset and distance


class GraphNetwork(nn.Module):
    """Encodes each node, exchanges messages along the edges (GATv2; Brody et al. 2022), and decodes a displacement."""

    def __init__(self, features: int, width: int, layers: int) -> None:
        """`features` numbers at each node; `width` is a multiple of four."""
        super().__init__()
        self.encoder = nn.Sequential(nn.Linear(features, width), nn.SiLU(), nn.Linear(width, width))
        self.layers = nn.ModuleList(GATv2Conv(width, width // HEADS, HEADS, edge_dim=EDGE) for _ in range(layers))
        self.decoder = nn.Sequential(nn.Linear(width, width), nn.SiLU(), nn.Linear(width, 3))

    def forward(self, nodes: torch.Tensor, edges: torch.Tensor, along: torch.Tensor) -> torch.Tensor:
        """Maps (B M, features) nodes of B bodies, (2, B E) edges and (B E, 4) offsets to (B M, 3) displacements."""
        state = self.encoder(nodes)
        for layer in self.layers:
            state = state + nn.functional.silu(layer(state, edges, along))
        return self.decoder(state)
