textures/all/stages
{
	qer_editorimage textures/all/editor.tga
	q3map_surfacelight 1500
	q3map_lightimage textures/all/light
	q3map_lightsubdivide 64
	surfaceparm nomarks
	surfaceparm trans
	cull none
	sort additive
	deformVertexes wave 100 sin 0 2 0 0.5
	deformVertexes bulge 3 10 1
	deformVertexes move 1 0 2 triangle 0 4 0 1
	polygonOffset
	nopicmip
	{
		map $lightmap
		rgbGen identity
		tcGen lightmap
	}
	{
		clampmap textures/all/a.tga
		blendFunc GL_SRC_ALPHA GL_ONE_MINUS_SRC_ALPHA
		alphaFunc GE128
		depthWrite
		depthFunc equal
		rgbGen wave noise 0.5 0.25 0 3
		alphaGen lightingSpecular
		tcGen environment
		tcMod scroll 0.1 -0.2
		tcMod stretch sawtooth 1 0.5 0 2
		tcMod transform 1 0.5 0 1 0 0.25
		tcMod rotate 45
	}
	{
		animMap 8 textures/all/f1 textures/all/f2 textures/all/f3
		blendFunc add
		rgbGen const ( 0.5 0.25 1 )
		alphaGen portal 512
		tcGen vector ( 1 0 0 ) ( 0 0 1 )
		tcMod turb 0 0.1 0.25 1
		tcMod scale 2 2
		tcMod entityTranslate
		detail
	}
	{
		videoMap video/intro.roq
		blendFunc filter
		rgbGen lightingDiffuse
		alphaGen wave inversesawtooth 0 1 0 1
	}
}
