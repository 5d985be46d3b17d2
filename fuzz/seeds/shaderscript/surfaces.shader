// skies, fogs, sprites, portals
textures/skies/dusk
{
	surfaceparm sky
	surfaceparm noimpact
	q3map_sunExt 1 0.9 0.7 120 35 60 2 16
	q3map_skylight 80 3
	skyParms env/dusk 512 -
	{
		map textures/skies/clouds
		tcMod scroll 0.02 0.01
	}
}
textures/fog/low { surfaceparm fog fogParms ( 0.3 0.3 0.4 ) 900 }
models/sprite
{
	cull back
	clampTime 4
	deformVertexes autosprite2
	deformVertexes normal 0.5 2
	{
		map models/sprite.tga
		blendFunc GL_ONE GL_ONE
		rgbGen vertex
		alphaGen oneMinusEntity
	}
}
models/text
{
	deformVertexes text3
	{ map $whiteimage rgbGen exactVertex }
}
textures/portal
{
	portal
	entityMergable
	deformVertexes projectionShadow
	{
		map textures/portal.tga
		blendFunc GL_DST_COLOR GL_ZERO
		tcMod rotate -1e30
		rgbGen wave square nan inf 0 -1
	}
}
